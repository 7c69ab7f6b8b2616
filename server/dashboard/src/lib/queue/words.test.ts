import { describe, expect, it } from 'vitest';
import { homeOf, pausedBy, queueBadge, queueState, whatGoesOn } from './words';

const robot = { connection: 'connected', arm: 'idle', activity: 'none' } as const;
const queue = { paused: false, reason: 'resumed by anna', running: null, waiting_for: '' };
const paused = { ...queue, paused: true, reason: 'by anna' };
const held = { ...queue, waiting_for: 'somebody has control' };

describe('what goes on', () => {
  it('is nothing only where something could be started at once', () => {
    expect(whatGoesOn(robot, queue, 0)).toBe('Nothing is running or waiting.');
    expect(whatGoesOn(robot, queue, 2)).toBe('');
    expect(whatGoesOn({ ...robot, connection: 'lost' }, queue, 0)).toBe('');
    expect(whatGoesOn(null, null, 0)).toBe('');
    expect(whatGoesOn(robot, held, 1)).toBe('Somebody has control.');
  });

  it('says once that the arm is stopped, and that the queue is paused', () => {
    const found = whatGoesOn({ ...robot, arm: 'stopped' }, { ...paused, reason: 'the arm is stopped' }, 0);
    expect(found).toBe('Nothing moves until the arm is reset.');
    const reason = 'the stop could NOT BE DELIVERED';
    expect(whatGoesOn({ ...robot, connection: 'lost', arm: 'fault' }, { ...paused, reason }, 0)).toBe(
      'The queue is paused. The stop could NOT BE DELIVERED.',
    );
    expect(whatGoesOn(robot, paused, 0)).toBe('The queue is paused. By anna.');
  });

  it('is what the arm does, also while the queue is paused', () => {
    expect(whatGoesOn({ ...robot, activity: 'experiment' }, paused, 0)).toBe(
      'An experiment is running. The queue is paused. By anna.',
    );
  });
});

describe('the queue', () => {
  it('is ready only with a robot, and says why it waits', () => {
    expect(queueBadge(queue, true)).toEqual({ tone: 'good', text: 'ready' });
    expect(queueBadge(queue, false).tone).toBe('quiet');
    expect(queueState(queue, false).text).toBe('Nothing can run until the robot is connected.');
    expect(queueState({ ...queue, waiting_for: 'the link is lost' }, false)).toEqual({
      head: 'Waiting:',
      text: 'the link is lost.',
    });
  });

  it('that is paused lets what runs go on', () => {
    const running = { ...paused, running: '9f3c' };
    expect(queueState(running, true).text).toMatch(/^by anna\. The experiment .* goes on/);
    expect(queueState({ ...paused, reason: 'the arm is stopped' }, true)).toEqual({
      head: 'Paused:',
      text: 'the arm is stopped.',
    });
    const failed = { ...paused, reason: 'blocked. The run ramp failed: look' };
    expect(queueState(failed, true).text).toBe('blocked. The run ramp failed: look.');
    expect(queueState(failed, true, 'blocked').text).toBe('The run ramp failed: look.');
    const runs = [{ reason: '' }, { reason: 'blocked' }];
    expect(pausedBy(failed, runs)).toBe(runs[1]);
    expect(pausedBy(paused, runs)).toBeNull();
    expect(queueBadge(running, true)).toEqual({ tone: 'busy', text: 'running the last one' });
    expect(queueBadge(paused, true)).toEqual({ tone: 'warn', text: 'paused' });
  });
});

it('home is one screen, and the arm comes before the queue', () => {
  const screens = [
    homeOf(null, null),
    homeOf({ ...robot, connection: 'disconnected' }, queue),
    homeOf({ ...robot, connection: 'lost', arm: 'fault' }, queue),
    homeOf(robot, queue),
    homeOf(robot, paused),
    homeOf(robot, held),
    homeOf({ ...robot, activity: 'jog' }, paused),
    homeOf({ ...robot, arm: 'stopped' }, paused),
    homeOf({ ...robot, arm: 'fault', activity: 'experiment' }, queue),
  ].map((home) => home.screen);
  expect(screens).toEqual([
    'unknown',
    'disconnected',
    'lost',
    'ready',
    'paused',
    'waiting',
    'running',
    'stopped',
    'fault',
  ]);
});
