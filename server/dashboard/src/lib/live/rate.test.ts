import { expect, it } from 'vitest';
import { rateText, SampleRate } from './rate';

function receive(rate: SampleRate, from: number, to: number, hertz: number): void {
  for (let count = 0; from + count / hertz < to; count += 1) rate.heard(from + count / hertz);
}

it('is what arrives, not what ought to', () => {
  const rate = new SampleRate();
  expect(rate.rate(0)).toBeNull();
  receive(rate, 0, 4, 50);
  expect(rate.rate(4)).toBeCloseTo(50, 0);
  receive(rate, 4, 8, 12.5);
  expect(rate.rate(8)).toBeCloseTo(12.5, 0);
});

it('is that of the arm also when a page that has just joined gets seconds of samples at once', () => {
  const rate = new SampleRate();
  receive(rate, 100, 102, 50); // all of them in the page's first moment
  expect(rate.rate(102)).toBeCloseTo(50, 0);
  receive(rate, 102, 102.6, 50);
  expect(rate.rate(102.6)).toBeCloseTo(50, 0);
});

it('does not begin with a small one, and does not count a pause', () => {
  const rate = new SampleRate();
  receive(rate, 100, 100.4, 50);
  expect(rate.rate(100.4)).toBeNull();
  receive(rate, 100.4, 101, 50);
  expect(rate.rate(101)).toBeCloseTo(50, 0);
  expect(rate.rate(160)).toBeNull();
  receive(rate, 160, 161, 50);
  expect(rate.rate(161)).toBeCloseTo(50, 0);
});

it('falls while samples stay away', () => {
  const rate = new SampleRate();
  receive(rate, 0, 3, 50);
  expect(rate.rate(4.5)).toBeLessThan(40);
});

it('begins anew with a clock that does', () => {
  const rate = new SampleRate();
  receive(rate, 5000, 5003, 50);
  receive(rate, 10, 11, 50);
  expect(rate.rate(11)).toBeCloseTo(50, 0);
});

it('is told to be thinned for a while', () => {
  const rate = new SampleRate();
  expect(rate.isThinned(5)).toBe(false);
  rate.thinned(5);
  expect(rate.isThinned(6)).toBe(true);
  expect(rate.isThinned(60)).toBe(false);
});

it.each([
  [null, true, 'live'],
  [49.7, false, 'live 50 Hz'],
  [24.9, true, 'live 25 Hz, thinned'],
] as const)('%s, thinned %s: %s', (rate, isThinned, text) => {
  expect(rateText(rate, isThinned)).toBe(text);
});
