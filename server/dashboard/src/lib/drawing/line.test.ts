import { describe, expect, it } from 'vitest';
import { drawLine, TOLERANCE, type Pen } from './line';

type Point = [number, number];
const AS_IT_IS = { factor: 1, from: 0 };

class Paper implements Pen {
  strokes: Point[][] = [];
  moveTo(x: number, y: number): void {
    this.strokes.push([[x, y]]);
  }
  lineTo(x: number, y: number): void {
    this.strokes.at(-1)!.push([x, y]);
  }
}

function drawn(x: readonly number[], y: readonly (number | null | undefined)[]): Point[][] {
  const paper = new Paper();
  drawLine(paper, x, y, 0, x.length - 1, AS_IT_IS, AS_IT_IS);
  return paper.strokes;
}

/** Where a stroke is at x. */
function heightAt(stroke: readonly Point[], x: number): number {
  const next = stroke.findIndex(([place]) => place >= x);
  if (next <= 0) return stroke[Math.max(0, next)]![1];
  const [[x0, y0], [x1, y1]] = [stroke[next - 1]!, stroke[next]!];
  return x1 === x0 ? y1 : y0 + ((y1 - y0) * (x - x0)) / (x1 - x0);
}

const numbers = (count: number): number[] => Array.from({ length: count }, (_, index) => index);

describe('a line through samples', () => {
  it('needs two points where it is straight', () => {
    expect(
      drawn(
        numbers(500),
        numbers(500).map((x) => 3 + 0.5 * x),
      ),
    ).toEqual([
      [
        [0, 3],
        [499, 252.5],
      ],
    ]);
    expect(
      drawn(
        numbers(9),
        numbers(9).map(() => 7),
      )[0],
    ).toHaveLength(2);
  });

  it('is never further from a sample than the tolerance, and has fewer points', () => {
    const x = numbers(800).map((place) => place * 1.3);
    const y = x.map((place) => 80 + 60 * Math.sin(place / 40) + 3 * Math.sin(place / 7));
    const [stroke] = drawn(x, y);
    expect(stroke!.length).toBeLessThan(400);
    x.forEach((place, row) =>
      expect(Math.abs(heightAt(stroke!, place) - y[row]!)).toBeLessThanOrEqual(TOLERANCE + 1e-9),
    );
  });

  it('keeps every peak where many samples share a pixel', () => {
    const x = numbers(10_000).map((row) => row / 100);
    const y = x.map((_, row) => (row === 4321 ? 90 : row === 7777 ? -40 : row % 2));
    const [stroke] = drawn(x, y);
    expect(stroke!.length).toBeLessThan(450);
    const heights = stroke!.map(([, height]) => height);
    expect(Math.max(...heights)).toBe(90);
    expect(Math.min(...heights)).toBe(-40);
  });

  it('is drawn in pixels', () => {
    const paper = new Paper();
    drawLine(paper, [0, 1, 2], [10, 20, 30], 1, 2, { factor: 100, from: 5 }, { factor: -2, from: 80 });
    expect(paper.strokes).toEqual([
      [
        [105, 40],
        [205, 20],
      ],
    ]);
  });

  it('follows a step straight up', () => {
    expect(drawn([0, 10, 10, 20], [5, 5, 50, 50])).toEqual([
      [
        [0, 5],
        [10, 5],
        [10, 50],
        [20, 50],
      ],
    ]);
  });

  it('begins anew behind a gap, and goes through where only another line has a sample', () => {
    expect(drawn(numbers(6), [1, 1, null, 1, undefined, 1])).toEqual([
      [
        [0, 1],
        [1, 1],
      ],
      [
        [3, 1],
        [5, 1],
      ],
    ]);
    expect(drawn(numbers(3), [null, undefined, null])).toEqual([]);
  });
});
