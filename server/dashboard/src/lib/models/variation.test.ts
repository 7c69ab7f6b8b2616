import { describe, expect, it } from 'vitest';
import { variationPictures, type TimeDomain, type Variation } from './variation';

const variation = (name: string, varying: number, values: (number | null)[]): Variation =>
  ({
    name,
    unit: 'kg',
    values,
    expected: 1,
    deviation: 2,
    alone_constant: 0,
    alone_varying: varying,
    against: [
      { regressor: 'speed', joint: 1, value: 0.1, noise: 0.1 },
      { regressor: 'sign of speed', joint: 2, value: -0.9, noise: 0.1 },
    ],
  }) as unknown as Variation;

describe('what would have to move', () => {
  const found = {
    time: [0, 1, 2, 3, 4],
    parameters: [variation('a', 0.1, []), variation('b', 0.6, [0, 4, null, -4, 0])],
  } as unknown as TimeDomain;

  it('is ranked by what it explains, with gaps where nothing moves', () => {
    const [first, second] = variationPictures(found, 5);
    expect([first?.name, second?.name]).toEqual(['b', 'a']);
    expect(first?.lines).toEqual([
      [
        [0, 0.5],
        [0.25, 0.5 - 0.47],
      ],
      [
        [0.75, 0.5 + 0.47],
        [1, 0.5],
      ],
    ]);
    expect(first).toMatchObject({ goesWith: 'sign of speed of joint 2', within: false });
    expect(first?.expected).toBeCloseTo(0.47 / 4);
  });

  it('shows no more than asked for', () => {
    expect(variationPictures(found, 1)).toHaveLength(1);
  });
});
