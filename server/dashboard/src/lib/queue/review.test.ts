import { describe, expect, it } from 'vitest';
import { mayApprove, reviewText } from './review';

const APPROVAL = { by: 'bert', at: '2026-03-02T12:00:00Z', as_owner: false };

describe('the review of an experiment', () => {
  it('says what is missing, or who has approved', () => {
    expect(reviewText('operator', null)).toContain('another operator');
    expect(reviewText('owner', APPROVAL)).toContain('another owner');
    expect(reviewText(null, APPROVAL)).toBe('approved by bert');
    expect(reviewText(null, null)).toBe('');
  });

  it("is never one's own, and an owner's where it has to be", () => {
    expect(mayApprove('operator', 'anna', 'bert', false)).toBe(true);
    expect(mayApprove('operator', 'anna', 'anna', true)).toBe(false);
    expect(mayApprove('owner', 'anna', 'bert', false)).toBe(false);
    expect(mayApprove('owner', 'anna', 'olga', true)).toBe(true);
    expect(mayApprove(null, 'anna', 'bert', true)).toBe(false);
  });
});
