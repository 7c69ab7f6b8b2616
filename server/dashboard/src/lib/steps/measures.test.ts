import { describe, expect, it } from 'vitest';
import { goesOneWay, indexAfter, indexAt, measureStep, ONE_GO } from './measures';

const PERIOD = 0.001;
const time = Array.from({ length: 8001 }, (_, index) => index * PERIOD);
const BEGIN = 1;

/** Step at 1 s from 2 to 5 of a second-order system: its measures are known in closed form. */
function secondOrder(damping: number, frequency: number): number[] {
  const damped = frequency * Math.sqrt(1 - damping ** 2);
  return time.map((moment) => {
    const t = moment - BEGIN;
    if (t <= 0) return 2;
    const decay = Math.exp(-damping * frequency * t);
    const angle = damped * t;
    return 2 + 3 * (1 - decay * (Math.cos(angle) + (damping * frequency * Math.sin(angle)) / damped));
  });
}

const setPoint = time.map((moment) => (moment > BEGIN ? 5 : 2));

describe('a second-order step', () => {
  const damping = 0.4;
  const frequency = 5;
  const response = { time, position: secondOrder(damping, frequency), setPoint };
  const found = measureStep(response, 0.5, 8)!;

  it('overshoots by exp(−πζ/√(1−ζ²))', () => {
    const share = Math.exp((-Math.PI * damping) / Math.sqrt(1 - damping ** 2));
    expect(found.overshootShare).toBeCloseTo(share, 4);
    expect(found.overshoot).toBeCloseTo(3 * share, 3);
  });

  it("settles to 2 % within the envelope's bound, counted from the step", () => {
    const bound = -Math.log(0.02 * Math.sqrt(1 - damping ** 2)) / (damping * frequency);
    expect(found.settlingTime).toBeGreaterThan(0.6 * bound);
    expect(found.settlingTime).toBeLessThanOrEqual(bound + PERIOD);
    const at = response.position[Math.round((BEGIN + found.settlingTime!) / PERIOD) - 2]!;
    expect(Math.abs(at - 5)).toBeGreaterThan(0.02 * 3 * 0.99);
  });

  it('knows its target, and measures the same whichever cursor is first', () => {
    expect([found.initial, found.target, found.targetIsSetPoint]).toEqual([2, 5, true]);
    expect(measureStep(response, 8, 0.5)).toEqual(found);
  });

  it('measures downwards as upwards', () => {
    const mirrored = {
      time,
      position: response.position.map((value) => -value),
      setPoint: setPoint.map((value) => -value),
    };
    const down = measureStep(mirrored, 0.5, 8)!;
    expect(down.riseTime).toBe(found.riseTime);
    expect(down.overshoot).toBeCloseTo(found.overshoot!, 12);
    expect(down.settlingTime).toBe(found.settlingTime);
  });
});

describe('a first-order response without a set point', () => {
  it('rises in τ·ln 9, never overshoots', () => {
    const position = time.map((moment) => 1 - Math.exp(-moment / 0.5));
    const found = measureStep({ time, position, setPoint: null }, 0, 8)!;
    expect(found.riseTime).toBeCloseTo(0.5 * Math.log(9), 2);
    expect(found.targetIsSetPoint).toBe(false);
    expect(found.overshootShare).toBeLessThan(1e-5);
  });
});

describe('what a window does not tell', () => {
  it('is null', () => {
    const rest = measureStep({ time, position: time.map(() => 3), setPoint: null }, 0, 1)!;
    expect([rest.riseTime, rest.overshoot, rest.settlingTime, rest.finalError]).toEqual([
      null,
      null,
      null,
      0,
    ]);
    const early = measureStep({ time, position: secondOrder(0.4, 5), setPoint }, 0.9, 1.1)!;
    expect([early.riseTime, early.settlingTime]).toEqual([null, null]);
    expect(measureStep({ time, position: time, setPoint: null }, 1, 1.0005)).toBeNull();
  });
});

describe('a motion that is no step', () => {
  const control = Array.from({ length: 400 }, (_, index) => index * 0.02);
  const oneWay = (goal: (moment: number) => number): boolean => goesOneWay(control, control.map(goal));

  it('has neither rise time nor overshoot nor settling time', () => {
    const goal = time.map((moment) => Math.sin(moment) + 0.1 * moment);
    const found = measureStep({ time, position: goal, setPoint: goal }, 0, 8)!;
    expect([found.isStep, found.riseTime, found.overshoot, found.settlingTime]).toEqual([
      false,
      null,
      null,
      null,
    ]);
    expect(found.finalError).toBe(0);
  });

  it('goes back, or rests in between', () => {
    expect(oneWay((moment) => Math.sin(5 * moment))).toBe(false);
    expect(oneWay((moment) => Math.floor(moment / (2 * ONE_GO)))).toBe(false);
    expect(oneWay(() => 1)).toBe(false);
  });

  it('is none where it goes up or down in one go, also in small counts', () => {
    expect(oneWay((moment) => (moment > 1 ? 5 : 2))).toBe(true);
    expect(oneWay((moment) => -Math.floor(Math.min(10, Math.max(0, 10 * (moment - 1)))))).toBe(true);
  });
});

describe('rise time', () => {
  it('is of the way of the set point, as the service has it: an error at the beginning does not change it', () => {
    const ramp = time.map((moment) => Math.min(10, Math.max(0, 5 * (moment - 1))));
    const behind = ramp.map((value) => value + 1);
    const found = measureStep({ time, position: behind, setPoint: ramp }, 0, 8)!;
    expect(found.riseTime).toBeCloseTo(1.6, 2);
  });

  it('is counted from the rest before the motion, not from the reading at a cursor', () => {
    const ramp = time.map((moment) => Math.min(10, Math.max(0, 5 * (moment - 1))));
    const noisy = ramp.map((value, index) => value + (index < 1000 ? 0.5 * (-1) ** index : 0));
    const found = [0.5, 0.501].map((from) => measureStep({ time, position: noisy, setPoint: ramp }, from, 8));
    expect(found.map((one) => one!.riseTime!.toFixed(2))).toEqual(['1.60', '1.60']);
  });
});

describe('samples around a moment', () => {
  it('are found by bisection', () => {
    expect(indexAt([0, 1, 2, 3], 1.5)).toBe(2);
    expect(indexAt([0, 1, 2, 3], 2)).toBe(2);
    expect(indexAfter([0, 1, 2, 3], 2)).toBe(3);
    expect(indexAfter([0, 1, 2, 3], 9)).toBe(4);
  });
});
