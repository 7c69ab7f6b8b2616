import { describe, expect, it } from 'vitest';
import { ageText, lastHeard, ServiceClock } from './age';

describe('the age of a value', () => {
  it('is told by the service and grows by this clock', () => {
    const clock = new ServiceClock();
    expect(clock.age(100, 5)).toBeNull();
    clock.heard(100.02, 1e9, 5);
    expect(clock.age(100, 5)).toBeCloseTo(0.02);
    expect(clock.age(100, 7.5)).toBeCloseTo(2.52);
    expect(clock.silence(7.5)).toBeCloseTo(2.5);
  });

  it('and the time of day are those of the service, whatever this computer takes for the time', () => {
    const clock = new ServiceClock();
    expect(clock.wall(5)).toBeNull();
    clock.heard(100, 1_700_000_000.25, 5);
    expect(clock.wall(65)).toBe(1_700_000_060_250);
    clock.heard(101, 1_700_000_300, 66);
    expect(clock.wall(66)).toBe(1_700_000_300_000);
  });

  it('is never negative', () => {
    const clock = new ServiceClock();
    clock.heard(100, 1e9, 5);
    expect(clock.age(101, 5)).toBe(0);
  });

  it('tells a computer that was started anew from a clock that jitters', () => {
    const clock = new ServiceClock();
    expect(clock.wentBack(3, 1)).toBe(false);
    clock.heard(1000, 1e9, 5);
    expect(clock.wentBack(999.5, 1)).toBe(false);
    expect(clock.wentBack(12, 1)).toBe(true);
  });

  it('is the newest sample’s also where the service was heard of later', () => {
    expect(lastHeard(4.7, 47)).toBe('the newest sample is 47 s old');
    expect(lastHeard(4.7, null)).toBe('the service was last heard 4.7 s ago');
    expect(lastHeard(null, null)).toBe('');
  });

  it.each([
    [null, 'never'],
    [0.0204, '20 ms'],
    [3.42, '3.4 s'],
    [61, '61 s'],
    [600, '10 min'],
    [86400, '24 h'],
  ])('reads %s as %s', (age, text) => {
    expect(ageText(age)).toBe(text);
  });
});
