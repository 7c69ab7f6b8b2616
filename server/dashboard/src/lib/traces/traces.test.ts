import { describe, expect, it } from 'vitest';
import { columnOf, isThinned, refined, rmsDifference, wholeRange, type Signals } from './columns';
import { linkInWords } from './counters';
import { moved, serves, toAsk, within, zoomed } from './zoom';

const signals = (time: number[], samples = time.length): Signals => ({
  joints: [1, 3],
  samples,
  time,
  position: [time.map((moment) => moment * 10), time.map((moment) => -moment)],
  set_point: [time, time],
  error: null,
  drive: [time, time],
});

describe('a finer part of a trace', () => {
  const whole = signals([0, 2, 4, 6, 8], 100);

  it('takes the place of the coarse samples in its range, in every signal', () => {
    const fine = refined(whole, signals([3, 3.5, 4, 4.5, 5]));
    expect(fine.time).toEqual([0, 2, 3, 3.5, 4, 4.5, 5, 6, 8]);
    expect(fine.position[0]).toEqual(fine.time.map((moment) => moment * 10));
    expect(fine.set_point![1]).toEqual(fine.time);
    expect(fine.error).toBeNull();
  });

  it('may be at either end, or empty', () => {
    expect(refined(whole, signals([0, 1])).time).toEqual([0, 1, 2, 4, 6, 8]);
    expect(refined(whole, signals([7, 9])).time).toEqual([0, 2, 4, 6, 7, 9]);
    expect(refined(whole, signals([]))).toBe(whole);
  });

  it('is worth asking for where samples were left out', () => {
    expect(isThinned(whole)).toBe(true);
    expect(isThinned(signals([0, 1]))).toBe(false);
  });
});

describe('columns', () => {
  it('are found by joint, and scaled', () => {
    expect(columnOf(signals([1, 2]), 'position', 3, 2)).toEqual([-2, -4]);
    expect(columnOf(signals([1, 2]), 'position', 1, 2, 10)).toEqual([0, 20]);
    expect(columnOf(signals([1, 2]), 'position', 2)).toBeNull();
    expect(columnOf(signals([1, 2]), 'error', 1)).toBeNull();
  });

  it('of several traces reach from the first to the last moment', () => {
    expect(wholeRange([signals([1, 2]), signals([0.5, 1.5]), signals([])])).toEqual([0.5, 2]);
    expect(wholeRange([])).toBeNull();
  });

  it('differ by the root of the mean square', () => {
    expect(rmsDifference([1, 2, 3], [1, 5, -1])).toBeCloseTo(Math.sqrt(25 / 3), 12);
  });
});

describe('zooming', () => {
  const WHOLE = [0, 100] as const;

  it('keeps the moment under the pointer in its place', () => {
    expect(zoomed(null, WHOLE, 0.5, 20)).toEqual([10, 60]);
    expect(zoomed([10, 60], WHOLE, 0.5, 20)).toEqual([15, 40]);
  });

  it('ends at the whole, and at a tenth of a second', () => {
    expect(zoomed([10, 60], WHOLE, 8)).toBeNull();
    const [low, high] = zoomed([50, 50.2], WHOLE, 0.01)!;
    expect(high - low).toBeCloseTo(0.1, 12);
  });

  it('moves within the record', () => {
    expect(moved([10, 20], WHOLE, 0.5)).toEqual([15, 25]);
    expect(moved([10, 20], WHOLE, -5)).toEqual([0, 10]);
    expect(moved([85, 95], WHOLE, 5)).toEqual([90, 100]);
    expect(moved(null, WHOLE, 1)).toBeNull();
    expect(within([-10, 300], WHOLE)).toBeNull();
  });

  it('asks for a little more, and not again for what is there', () => {
    const asked = toAsk([10, 20], WHOLE);
    expect(asked).toEqual([7, 23]);
    expect(serves(asked, [8, 22])).toBe(true);
    expect(serves(asked, [6, 16])).toBe(false);
    expect(serves(asked, [10, 11])).toBe(false);
    expect(serves(null, [10, 11])).toBe(false);
    expect(toAsk([1, 99], WHOLE)).toEqual([0, 100]);
  });
});

describe('counters of the link', () => {
  it('tell what went wrong, and how long an answer took', () => {
    const counters = {
      requests: 500,
      retries: 2,
      torn: 0,
      round_trip_p50_s: 0.00717,
      round_trip_p99_s: 0.0299,
    };
    expect(linkInWords(counters)).toBe('500 requests, retries 2, round trip 7.2 ms, 99 % within 30 ms');
    expect(linkInWords({})).toBe('');
  });
});
