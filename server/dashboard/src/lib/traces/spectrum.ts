/** The spectrum of a signal: which oscillations it has, and how large. Pure. */

import { valueAt } from './compare';

export interface Spectrum {
  /** Hz, from the first above 0 to half the sampling rate. */
  frequency: number[];
  /** Of a sine of that frequency, in the signal's unit. */
  amplitude: number[];
}

/** Fewer samples say nothing about frequencies. */
const LEAST = 16;

/** In place, of a length that is a power of two: Cooley and Tukey, Mathematics of Computation 19 (1965) 297. */
function transform(real: Float64Array, imaginary: Float64Array): void {
  const count = real.length;
  for (let index = 1, reversed = 0; index < count; index += 1) {
    let bit = count >> 1;
    for (; reversed & bit; bit >>= 1) reversed ^= bit;
    reversed ^= bit;
    if (index < reversed) {
      [real[index], real[reversed]] = [real[reversed]!, real[index]!];
      [imaginary[index], imaginary[reversed]] = [imaginary[reversed]!, imaginary[index]!];
    }
  }
  for (let size = 2; size <= count; size *= 2) {
    for (let start = 0; start < count; start += size) {
      for (let at = 0; at < size / 2; at += 1) {
        const angle = (-2 * Math.PI * at) / size;
        const [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
        const [low, high] = [start + at, start + at + size / 2];
        const a = cosine * real[high]! - sine * imaginary[high]!;
        const b = sine * real[high]! + cosine * imaginary[high]!;
        real[high] = real[low]! - a;
        imaginary[high] = imaginary[low]! - b;
        real[low]! += a;
        imaginary[low]! += b;
      }
    }
  }
}

/**
 * The amplitude spectrum of samples at `time` (s), which need not be even. A straight line is taken off, so that a ramp
 * is no oscillation, and a Hann window keeps what does not fit into the record from smearing. null for too few samples.
 */
export function spectrumOf(time: readonly number[], column: readonly number[]): Spectrum | null {
  const count = time.length;
  const span = (time.at(-1) ?? 0) - (time[0] ?? 0);
  if (count < LEAST || !(span > 0)) return null;
  const step = span / (count - 1);
  const even = Array.from({ length: count }, (_, at) =>
    valueAt(time, column, Math.min(time[0]! + at * step, time.at(-1)!))!,
  );
  const middle = (count - 1) / 2;
  const mean = even.reduce((sum, value) => sum + value, 0) / count;
  const slope =
    even.reduce((sum, value, at) => sum + (at - middle) * value, 0) / ((count * (count * count - 1)) / 12);
  let size = 1;
  while (size < count) size *= 2;
  const [real, imaginary] = [new Float64Array(size), new Float64Array(size)];
  let weights = 0;
  even.forEach((value, at) => {
    const window = 0.5 - 0.5 * Math.cos((2 * Math.PI * at) / (count - 1));
    weights += window;
    real[at] = window * (value - mean - slope * (at - middle));
  });
  transform(real, imaginary);
  const places = Array.from({ length: size / 2 - 1 }, (_, at) => at + 1);
  return {
    frequency: places.map((at) => at / (size * step)),
    amplitude: places.map((at) => (2 * Math.hypot(real[at]!, imaginary[at]!)) / weights),
  };
}
