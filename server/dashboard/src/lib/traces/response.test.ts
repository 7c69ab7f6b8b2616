import { describe, expect, it } from 'vitest';
import type { Signals } from './columns';
import { responseOf } from './response';

const signals: Signals = {
  joints: [1, 2],
  samples: 2,
  time: [0, 1],
  position: [
    [0.5, 0.5 + Math.PI],
    [0, 0.002],
  ],
  set_point: [
    [0.5, 0.5 + Math.PI / 2],
    [0, 0],
  ],
  error: null,
  drive: null,
};

describe('the response that is drawn', () => {
  it('has the change of position and set point of each joint that moved, in its unit', () => {
    const found = responseOf(signals, [{ joint: 1, unit: '°' }], (joint) => `colour ${joint}`);
    expect(found?.data).toEqual([
      [0, 1],
      [0, 180],
      [0, 90],
    ]);
    expect(found?.series.map((one) => one.label)).toEqual(['J1 position', 'J1 set point']);
  });

  it('leaves joints of another unit out, and is nothing where none moved', () => {
    const both = [
      { joint: 2, unit: 'mm' },
      { joint: 1, unit: '°' },
    ];
    expect(responseOf(signals, both, String)).toMatchObject({ joints: [2], unit: 'mm' });
    expect(responseOf(signals, [], String)).toBeNull();
  });

  it('does without set points where the record has none', () => {
    const found = responseOf({ ...signals, set_point: null }, [{ joint: 1, unit: '°' }], String);
    expect(found?.series).toHaveLength(1);
  });
});
