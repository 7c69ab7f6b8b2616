import { describe, expect, it } from 'vitest';
import { bytes, duration, fixed, shortest, significant } from './format';

describe('numbers', () => {
  it.each([
    [-1.234, 2, '−1.23'],
    [-0.001, 2, '0.00'],
    [null, 2, '–'],
    [NaN, 2, '–'],
  ])('%s with %s digits is %s', (value, digits, text) => expect(fixed(value, digits)).toBe(text));

  it.each([
    [123456, '123456'],
    [1.2345, '1.23'],
    [-0.00012345, '−0.000123'],
    [0, '0'],
    [1.5e-7, '1.50e−7'],
    [2.5e9, '2.50e9'],
  ])('%s is %s', (value, text) => expect(significant(value)).toBe(text));

  it.each([
    [0.006, '0.006'],
    [1.83e-6, '1.83e−6'],
    [2e-6, '2e−6'],
    [10, '10'],
  ])('%s, shortest, is %s', (value, text) => expect(shortest(value, 4)).toBe(text));

  it.each([
    [0, '0 B'],
    [81_923_182_592, '81.9 GB'],
  ])('%s bytes are %s', (value, text) => expect(bytes(value)).toBe(text));

  it.each([
    [0.42, '0.42 s'],
    [200, '3 min 20 s'],
    [7500, '2 h 05 min'],
    [273_600, '3 d 4 h'],
  ])('%s s are %s', (value, text) => expect(duration(value)).toBe(text));
});
