import { describe, expect, it } from 'vitest';
import type { Machine } from '../api/types';
import { Held, jogKeyOf, speedOf, stepSpeedOf, TOP_SPEED } from './jog';

const MACHINE = {
  joints: [{ kind: 'revolute' }, { kind: 'revolute' }, { kind: 'revolute' }],
  limits: { joints: [{ speed: 1.6 }, { speed: 0.2 }, { speed: null }] },
} as unknown as Machine;

describe('jogging', () => {
  it('drives a joint never faster than its own limit, nor than jogging allows', () => {
    expect(speedOf(MACHINE, 1, 5)).toBe(TOP_SPEED);
    expect(speedOf(MACHINE, 2, 5)).toBe(0.2);
    expect(speedOf(MACHINE, 3, 0.1)).toBe(0.1);
  });

  it('drives and steps a joint that slides at 0.2 m/s for each rad/s', () => {
    const machine = {
      joints: [{ kind: 'prismatic' }, { kind: 'prismatic' }],
      limits: { joints: [{ speed: null }, { speed: 0.03 }] },
    } as unknown as Machine;
    expect(speedOf(machine, 1, 0.1)).toBeCloseTo(0.02);
    expect(speedOf(machine, 1, 5)).toBeCloseTo(0.07);
    expect(speedOf(machine, 2, 5)).toBe(0.03);
    expect(stepSpeedOf(machine, 1)).toBeCloseTo(0.05);
    expect(stepSpeedOf(MACHINE, 1)).toBe(0.25);
  });

  it('sends what is held, and an empty command when nothing is: hold', () => {
    const held = new Held();
    held.press(1, 1);
    held.press(2, -1);
    expect(held.velocities(MACHINE, 0.3)).toEqual({ 1: 0.3, 2: -0.2 });
    expect(held.release(1)).toBe(true);
    expect(held.release(1)).toBe(false);
    held.releaseAll();
    expect(held.isAny).toBe(false);
    expect(held.velocities(MACHINE, 0.3)).toEqual({});
  });

  it('knows its keys and no others', () => {
    expect(jogKeyOf('ArrowLeft', 6)).toEqual({ drive: -1 });
    expect(jogKeyOf('ArrowRight', 6)).toEqual({ drive: 1 });
    expect(jogKeyOf('3', 6)).toEqual({ choose: 3 });
    expect(jogKeyOf('4', 3)).toBeNull();
    expect(jogKeyOf('0', 3)).toBeNull();
    expect(jogKeyOf(' ', 3)).toBeNull();
  });
});
