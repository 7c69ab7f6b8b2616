import { describe, expect, it } from 'vitest';
import type { Machine } from '../api/types';
import { shownAs, unitOf } from './units';

const machine = {
  joints: [
    { kind: 'revolute', drive: { kind: 'dc_motor' } },
    { kind: 'prismatic', drive: { kind: 'gain' } },
    { kind: 'revolute', drive: { kind: 'gain' } },
  ],
} as unknown as Machine;

describe('the unit in which a signal is shown', () => {
  it('is what was chosen for angles', () => {
    expect(Math.PI * shownAs(machine, 1, 'position', '°').factor).toBeCloseTo(180);
    expect(shownAs(machine, 1, 'set_point', 'rad')).toMatchObject({ unit: 'rad', factor: 1 });
    expect(shownAs(machine, 1, 'error', 'rad')).toMatchObject({ unit: 'mrad', factor: 1000 });
  });

  it('is a length on a prismatic joint, whatever was chosen for angles', () => {
    for (const angle of ['°', 'rad'] as const) {
      expect(shownAs(machine, 2, 'position', angle)).toMatchObject({ unit: 'mm', factor: 1000 });
    }
  });

  it('is what drives the joint', () => {
    expect([1, 2, 3].map((joint) => shownAs(machine, joint, 'drive', '°').unit)).toEqual(['V', 'N', 'N·m']);
  });

  it('names every unit of a chart once', () => {
    expect(unitOf(machine, [1, 2, 3], 'position', '°')).toBe('°, mm');
    expect(unitOf(machine, [1, 3], 'position', '°')).toBe('°');
  });
});
