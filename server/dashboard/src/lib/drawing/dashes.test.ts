import { expect, it } from 'vitest';
import { dashesOf } from './dashes';

it('dashes of lines that lie on one another fill the gaps of the others, one after the other', () => {
  expect(dashesOf(0, 1)).toEqual([6, 3]);
  const all = [0, 1, 2].map((place) => dashesOf(place, 3));
  const sum = (dashes: number[]): number => dashes.reduce((one, other) => one + other, 0);
  expect(all.map(sum)).toEqual([27, 27, 27]);
  expect(all).toEqual([
    [6, 21],
    [0, 9, 6, 12],
    [0, 18, 6, 3],
  ]);
});
