import { describe, expect, it } from 'vitest';
import type { FleetRobot } from '../api/types';
import { armOf, cardOf, SILENT_AFTER, summary } from './card';

const ROBOT: FleetRobot = {
  robot: 'left',
  machine: 'ma2000',
  simulated: true,
  connection: 'connected',
  connection_problem: '',
  arm: 'idle',
  cause: '',
  activity: 'none',
  limp: [],
  sample_age: 0.02,
  progress: null,
  unattended: false,
  control: { holder: 'nobody', name: null, expires: null, remaining: null },
  queue: {
    paused: false,
    reason: 'resumed by anna',
    since: '2026-01-01T00:00:00Z',
    queued: 2,
    running: null,
    waiting_for: '',
    attended_until: null,
    review: null,
  },
};

const robot = (changes: Partial<FleetRobot>): FleetRobot => ({ ...ROBOT, ...changes });

describe('the card of an arm', () => {
  it('says that an arm is idle, how old its sample is, and what waits', () => {
    expect(cardOf(ROBOT, 0.1)).toMatchObject({
      tone: 'good',
      state: 'idle',
      sample: 'sample 120 ms old',
      isLive: true,
      waiting: '2 waiting',
    });
  });

  it.each([
    [{ arm: 'fault', cause: 'joint 2: error above 0.5 rad' }, 'bad', 'fault'],
    [{ arm: 'stopped', cause: 'anna' }, 'warn', 'stopped'],
    [{ connection: 'lost' }, 'bad', 'link lost'],
    [{ connection: 'disconnected', sample_age: null, simulated: null }, 'quiet', 'not connected'],
    [{ sample_age: 2 }, 'warn', 'no fresh samples'],
    [{ limp: [2] }, 'warn', 'limp: joint 2'],
    [{ queue: { ...ROBOT.queue, paused: true } }, 'warn', 'idle'],
    [{ activity: 'experiment', arm: 'running' }, 'busy', 'experiment'],
  ] as const)('tells %o', (changes, tone, state) => {
    expect(cardOf(robot(changes as Partial<FleetRobot>), 0)).toMatchObject({ tone, state });
  });

  it('calls nothing live that the service has not told lately', () => {
    expect(cardOf(ROBOT, SILENT_AFTER)).toMatchObject({ tone: 'bad', state: 'not known', isLive: false });
  });

  it('counts arms by their condition', () => {
    const cards = [ROBOT, robot({ arm: 'fault' })].map((one) => cardOf(one, 0));
    expect(summary(cards)).toBe('2 arms: 1 idle, 1 at fault or out of reach');
  });
});

describe('what is known of several arms', () => {
  it('is stopped only if all are', () => {
    expect(armOf([robot({ arm: 'stopped' }), robot({ arm: 'fault' })])).toBe('stopped');
    expect(armOf([robot({ arm: 'stopped' }), ROBOT])).toBe('free');
    expect(armOf([robot({ arm: 'stopped' }), robot({ connection: 'lost' })])).toBe('unknown');
    expect(armOf([])).toBe('unknown');
  });
});
