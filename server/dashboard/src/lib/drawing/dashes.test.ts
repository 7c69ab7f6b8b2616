import { expect, it } from 'vitest';
import { DashedPen, dashesOf } from './dashes';

it('dashes of lines that lie on one another fill the gaps of the others, one after the other', () => {
  expect(dashesOf(0, 1)).toEqual([6, 3]);
  const all = [0, 1, 2].map((place) => dashesOf(place, 3));
  const sum = (dashes: number[]): number => dashes.reduce((one, other) => one + other, 0);
  expect(all.map(sum)).toEqual([18, 18, 18]);
  expect(all).toEqual([
    [6, 12],
    [0, 6, 6, 6],
    [0, 12, 6, 0],
  ]);
});

it('dashes have their lengths along the screen, however high the line swings', () => {
  const drawn: [from: number, to: number][] = [];
  let begin = 0;
  const pen = new DashedPen(
    { moveTo: (x) => (begin = x), lineTo: (x) => drawn.push([begin, x]) },
    dashesOf(1, 2),
  );
  pen.moveTo(0, 0);
  for (let x = 1; x <= 36; x += 1) pen.lineTo(x, 500 * (x % 2));
  const ends = [...new Set(drawn.map(([from]) => from))].map((from) => [
    from,
    Math.max(...drawn.filter((one) => one[0] === from).map(([, to]) => to)),
  ]);
  expect(ends).toEqual([
    [6, 12],
    [18, 24],
    [30, 36],
  ]);
});
