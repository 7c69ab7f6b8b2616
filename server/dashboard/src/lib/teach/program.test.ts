import { describe, expect, it } from 'vitest';
import type { Machine } from '../api/types';
import { moved, moveTo, problemOfName, programOf, told } from './program';

const MACHINE = {
  joints: [{ kind: 'revolute' }, { kind: 'revolute' }],
  limits: { joints: [] },
} as unknown as Machine;

describe('a taught program', () => {
  it('keeps the measured posture as a move to it', () => {
    expect(moveTo(MACHINE, [1, 2], [0.123456789, -1])).toEqual({
      kind: 'absolute',
      angles: { 1: 0.12346, 2: -1 },
      speed: 0.25,
    });
  });

  it('moves a joint that slides at 50 mm/s', () => {
    const machine = {
      ...MACHINE,
      joints: [{ kind: 'revolute' }, { kind: 'prismatic' }],
    } as unknown as Machine;
    expect(moveTo(machine, [1, 2], [0.1, 0.03])).toMatchObject({ speed: 0.05 });
  });

  it('says what each instruction does', () => {
    expect(told(moveTo(MACHINE, [1, 2], [Math.PI / 2, 0]), MACHINE, '°')).toBe('Move to J1 90.0°, J2 0.0°');
    expect(told({ kind: 'wait', duration: 2 }, MACHINE, '°')).toBe('Wait 2.0 s');
    expect(told({ kind: 'gripper', closed: true }, MACHINE, '°')).toBe('Close the gripper');
  });

  it('changes its order, and nothing at its ends', () => {
    expect(moved(['a', 'b', 'c'], 1, -1)).toEqual(['b', 'a', 'c']);
    expect(moved(['a', 'b', 'c'], 0, -1)).toEqual(['a', 'b', 'c']);
    expect(moved(['a', 'b', 'c'], 2, 1)).toEqual(['a', 'b', 'c']);
  });

  it('is named as the service allows', () => {
    expect(problemOfName('pick_1.b')).toBe('');
    expect(problemOfName('')).not.toBe('');
    expect(problemOfName('a b')).not.toBe('');
    expect(programOf('pick', 'ma2000', []).version).toBe(1);
  });
});
