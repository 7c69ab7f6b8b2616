import { describe, expect, it } from 'vitest';
import type { QueueStatus, RobotMessage } from '../../lib/api/types';
import { isOld } from '../../lib/camera/age';
import { ageLine, kioskState } from './state';

const robot = (changes: Partial<RobotMessage>): RobotMessage =>
  ({ connection: 'connected', arm: 'idle', activity: 'none', ...changes }) as RobotMessage;
const queue = (changes: Partial<QueueStatus> = {}): QueueStatus =>
  ({ paused: false, reason: '', queued: 0, ...changes }) as QueueStatus;
const LIVE = { isOpen: true, isStale: false, age: 0.02 };

describe('the screen at the arm', () => {
  it('says in one word what the arm does', () => {
    const word = (changes: Partial<RobotMessage>, more: Partial<QueueStatus> = {}): string =>
      kioskState(robot(changes), queue(more), LIVE).word;
    expect(word({})).toBe('Ready');
    expect(word({ activity: 'experiment' })).toBe('Moving');
    expect(word({ arm: 'stopped' })).toBe('Stopped');
    expect(word({ arm: 'fault' })).toBe('Fault');
    expect(word({}, { paused: true })).toBe('Queue paused');
    expect(word({ connection: 'disconnected' })).toBe('No arm is connected');
  });

  it('never says as known what is old', () => {
    const stale = { isOpen: true, isStale: true, age: 3 };
    expect(kioskState(robot({ activity: 'experiment' }), queue(), stale).word).toBe('Not known');
    expect(kioskState(robot({}), queue(), { ...LIVE, isOpen: false }).word).toBe('Not known');
    expect(ageLine(stale)).toBe('NOT LIVE: newest sample 3.0 s old');
    expect(ageLine({ ...stale, isOpen: false })).toMatch(/^No connection/);
    expect(ageLine(LIVE)).toBe('Live, 20 ms old');
    expect([isOld(0.2), isOld(1.1), isOld(NaN)]).toEqual([false, true, true]);
  });
});
