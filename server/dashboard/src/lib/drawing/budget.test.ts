import { describe, expect, it } from 'vitest';
import { FrameBudget } from './budget';

describe('a budget for drawing', () => {
  it('lets the first one begin at once', () => {
    expect(new FrameBudget(0.2, 0.1, 1).wait(5)).toBe(0);
  });

  it('has one drawing at a time', () => {
    const budget = new FrameBudget(0.2, 0.1, 1);
    budget.begun();
    expect(budget.wait(5.5)).toBe(Infinity);
    budget.spent(5, 0.6);
    expect(budget.wait(5.6)).toBeCloseTo(0.4);
  });

  it('takes no more than its share of the time', () => {
    const budget = new FrameBudget(0.2, 0.05, 1);
    budget.spent(10, 0.03);
    expect(budget.wait(10.03)).toBeCloseTo(0.12);
    expect(budget.wait(10.2)).toBe(0);
  });

  it('is not drawn more often than is of use, and not forgotten when it is dear', () => {
    const budget = new FrameBudget(0.2, 0.05, 1);
    budget.spent(10, 0.001);
    expect(budget.wait(10)).toBeCloseTo(0.05);
    budget.spent(20, 0.4);
    expect(budget.wait(20)).toBeCloseTo(1);
    budget.spent(30, 3);
    expect(budget.wait(30)).toBeCloseTo(3);
  });
});
