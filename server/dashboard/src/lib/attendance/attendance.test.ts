import { beforeEach, describe, expect, it } from 'vitest';
import { Attendance, HAND_MOVES, SAY_EVERY } from './attendance';

let said: number;
let now: number;
let isNeeded: boolean;
let attendance: Attendance;

beforeEach(() => {
  [said, now, isNeeded] = [0, 0, true];
  attendance = new Attendance({ isNeeded: () => isNeeded, say: () => (said += 1), now: () => now });
});

describe('attendance', () => {
  it('is said when the page is used, and not more often than every so often', () => {
    attendance.used();
    attendance.used();
    now = SAY_EVERY - 0.1;
    attendance.used();
    expect(said).toBe(1);
    now = SAY_EVERY;
    attendance.used();
    expect(said).toBe(2);
  });

  it('is not said where nothing needs it, and at once when something does', () => {
    isNeeded = false;
    attendance.used();
    expect(said).toBe(0);
    isNeeded = true;
    attendance.used();
    expect(said).toBe(1);
  });

  it('is said by a hand that moves the pointer, not by a page that moves or a table that shakes', () => {
    attendance.pointed(100, 100);
    attendance.pointed(100, 100);
    attendance.pointed(103, 98);
    expect(said).toBe(0);
    attendance.pointed(100 + HAND_MOVES, 100);
    expect(said).toBe(1);
  });
});
