import { expect, it } from 'vitest';
import type { Signals } from './columns';
import { besideOf, bestShift, difference, valueAt } from './compare';
import { spectrumOf } from './spectrum';

const PERIOD = 0.02;
const times = (count: number): number[] => Array.from({ length: count }, (_, at) => at * PERIOD);

function moved(begin: number, lag: number): Signals {
  const time = times(300);
  const step = (at: number): number => (at > begin ? 1 : 0);
  const position = time.map((at) => 2 + Math.max(0, 1 - Math.exp(-4 * Math.max(0, at - begin - lag))));
  const set_point = [time.map(step)];
  return { joints: [3], samples: 300, time, position: [position], set_point, error: null, drive: null };
}

it('a value lies between its samples, and nowhere else', () => {
  expect(valueAt([0, 1, 3], [0, 10, 30], 2)).toBe(20);
  expect(valueAt([0, 1], [0, 10], 1)).toBe(10);
  expect(valueAt([0, 1], [0, 10], 1.1)).toBeNull();
  expect(valueAt([], [], 0)).toBeNull();
});

it('a difference is taken at the moments of the first', () => {
  const first = { time: [0, 1, 2], column: [1, 1, 1] };
  expect(difference(first, { time: [0.5, 1.5], column: [2, 4] })).toEqual([null, 2, null]);
});

it('the best shift finds a motion that follows later, though both are told to begin alike', () => {
  expect(bestShift(moved(1, 0), moved(1.6, 0.12), 3)).toBeCloseTo(0.12, 2);
  expect(bestShift(moved(1, 0), moved(1, 0), 3)).toBeCloseTo(0, 6);
  expect(bestShift(moved(1, 0), moved(1, 0.1), 1)).toBe(0);
});

it('a sine is found at its frequency with its amplitude, beside a ramp that is none', () => {
  const time = times(1000);
  const { frequency, amplitude } = spectrumOf(
    time,
    time.map((at) => 5 + 3 * at + 0.4 * Math.sin(2 * Math.PI * 7 * at)),
  )!;
  const most = amplitude.indexOf(Math.max(...amplitude));
  expect(frequency[most]).toBeCloseTo(7, 1);
  expect(amplitude[most]).toBeCloseTo(0.4, 1);
  expect(frequency.at(-1)).toBeLessThan(25);
  expect(spectrumOf(times(5), times(5))).toBeNull();
});

it('is what the sum of its definition is', () => {
  const time = times(64);
  const column = time.map((_, at) => Math.sin(at * at));
  const found = spectrumOf(time, column)!;
  const mean = column.reduce((a, b) => a + b) / 64;
  const slope = column.reduce((sum, value, at) => sum + (at - 31.5) * value, 0) / ((64 * (64 * 64 - 1)) / 12);
  const windows = column.map((_, at) => 0.5 - 0.5 * Math.cos((2 * Math.PI * at) / 63));
  for (const k of [1, 5, 31]) {
    let [real, imaginary] = [0, 0];
    column.forEach((value, at) => {
      const part = windows[at]! * (value - mean - slope * (at - 31.5));
      real += part * Math.cos((2 * Math.PI * k * at) / 64);
      imaginary -= part * Math.sin((2 * Math.PI * k * at) / 64);
    });
    const sum = windows.reduce((a, b) => a + b);
    expect(found.amplitude[k - 1]).toBeCloseTo((2 * Math.hypot(real, imaginary)) / sum, 9);
  }
});

it('a difference is there with two traces, a spectrum with one', () => {
  expect(besideOf(['difference', 'spectrum'], 2)).toEqual(['difference', 'spectrum']);
  expect(besideOf(['difference', 'spectrum'], 1)).toEqual(['spectrum']);
});
