import { describe, expect, it } from 'vitest';
import { inWords } from './words';

const degrees = (value: number): number => (value * Math.PI) / 180;

describe('a trajectory in words', () => {
  it('is one line for a simple one', () => {
    expect(inWords({ kind: 'ramp', amplitude: degrees(21.6), duration: 0.65 })).toEqual([
      'ramp 21.6° in 0.65 s',
    ]);
    expect(inWords({ kind: 'slow_ramp', amplitude: degrees(-5), speed: degrees(4) })).toEqual([
      'slow ramp −5° at 4 °/s',
    ]);
    expect(inWords({ kind: 'via', times: [1, 2], points: [0.1, 0.2] })).toEqual(['via 2 points in 2 s']);
    expect(inWords({ kind: 'path', times: [0, 1, 2.5], positions: [[0], [1], [2]] })).toEqual([
      'path of 3 points in 2.5 s',
    ]);
  });

  it('is one line a piece of a sequence, with its joints', () => {
    const segments = [
      { move: { kind: 'step', amplitude: { 1: degrees(3), 2: degrees(-3) } }, joints: [1, 2] },
      { move: { kind: 'pause', duration: 0.5 }, joints: null },
    ];
    expect(inWords({ kind: 'sequence', segments })).toEqual(['step 3° / −3°, joints 1, 2', 'pause 0.5 s']);
  });
});
