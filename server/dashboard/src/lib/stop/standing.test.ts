import { describe, expect, it } from 'vitest';
import { armNow, type ArmNow, isResetOver, type Standing, StopStanding, SURE_AFTER } from './standing';
import type { RobotMessage } from '../api/types';
import type { StopState } from './stop';

/** What stands after this has been told, each for `every` s. */
function follow(kind: StopState['kind'], arms: readonly ArmNow[], every = 0.1): Standing[] {
  const standing = new StopStanding(kind);
  return arms.map((arm, index) => standing.heard(arm, index * every));
}

describe('what is known of the arm', () => {
  it.each([
    [true, { connection: 'connected', arm: 'stopped' }, 'stopped'],
    [true, { connection: 'connected', arm: 'fault' }, 'stopped'],
    [true, { connection: 'connected', arm: 'running' }, 'free'],
    [true, { connection: 'lost', arm: 'stopped' }, 'unknown'],
    [true, { connection: 'connected', arm: 'disconnected' }, 'unknown'],
    [false, { connection: 'connected', arm: 'stopped' }, 'unheard'],
    [true, null, 'unknown'],
  ] as const)('heard %s, %o: %s', (isHeard, robot, expected) => {
    expect(armNow(isHeard, robot)).toBe(expected);
  });
});

describe('a confirmed stop', () => {
  it('holds while the arm is stopped, and is past as soon as it is not, for good', () => {
    expect(follow('confirmed', ['stopped', 'stopped', 'free', 'stopped'])).toEqual([
      'holds',
      'holds',
      'past',
      'past',
    ]);
  });

  it('is given a moment until the live messages tell it as well', () => {
    expect(follow('confirmed', ['free', 'free', 'stopped', 'stopped'])).not.toContain('past');
    expect(follow('confirmed', ['free', 'free'], SURE_AFTER)).toEqual(['holds', 'past']);
  });

  it('is not claimed while nothing is heard of the arm, and holds again if it is still stopped', () => {
    expect(follow('confirmed', ['stopped', 'unknown', 'stopped'], 60)).toEqual(['holds', 'unknown', 'holds']);
    expect(follow('confirmed', ['stopped', 'unknown', 'free'])).toEqual(['holds', 'unknown', 'past']);
  });
});

describe('a stop that was not delivered', () => {
  it('stays urgent while the arm is known to go on', () => {
    expect(follow('not delivered', ['free', 'free', 'free'], 60)).toEqual(['holds', 'holds', 'holds']);
  });

  it('is past once the connection is back and the arm is known, however it is', () => {
    const free: ArmNow[] = ['unknown', 'free', 'free'];
    expect(follow('not delivered', free, SURE_AFTER)).toEqual(['unknown', 'holds', 'past']);
    expect(follow('not delivered', ['unheard', 'unknown'])).toEqual(['unknown', 'answered']);
    const stopped: ArmNow[] = ['unknown', 'stopped', 'stopped'];
    expect(follow('not delivered', stopped, SURE_AFTER)).toEqual(['unknown', 'holds', 'past']);
  });

  it('is past when the arm has been stopped after all', () => {
    expect(follow('not delivered', ['free', 'stopped', 'stopped'], SURE_AFTER).at(-1)).toBe('past');
  });
});

describe('a stop that was sent and not confirmed', () => {
  it('stays while the arm is said to be stopped, and is past when it no longer is', () => {
    expect(follow('delivered', ['stopped', 'unknown', 'stopped'], 60).at(-1)).toBe('holds');
    expect(follow('delivered', ['stopped', 'free']).at(-1)).toBe('past');
    expect(follow('delivered', ['free', 'free'], 60).at(-1)).toBe('holds');
  });
});

it('a reset holds until the connection is gone or the arm is stopped again, and its own stop may be told late', () => {
  const robot = (arm: string, connection = 'connected'): RobotMessage =>
    ({ arm, connection }) as RobotMessage;
  expect(isResetOver(robot('stopped'), robot('stopped'))).toBe(false);
  expect(isResetOver(robot('stopped'), robot('idle'))).toBe(false);
  expect(isResetOver(robot('idle'), robot('fault'))).toBe(true);
  expect(isResetOver(robot('idle'), robot('idle', 'lost'))).toBe(true);
  expect(isResetOver(robot('idle'), robot('disconnected', 'disconnected'))).toBe(true);
});
