import { describe, expect, it } from 'vitest';
import type { Me } from '../api/types';
import { reviewText, whyNotApprove } from './review';

const APPROVAL = { by: 'bert', at: '2026-03-02T12:00:00Z', as_owner: false };

function person(name: string, more: Partial<Me> = {}): Me {
  return { name, role: 'operator', owner_of: [], is_known: true, ...more };
}

describe('the review of an experiment', () => {
  it('says what is missing, or who has approved', () => {
    expect(reviewText('operator', null)).toContain('another operator');
    expect(reviewText('owner', APPROVAL)).toContain('another owner');
    expect(reviewText(null, APPROVAL)).toBe('approved by bert');
    expect(reviewText(null, null)).toBe('');
  });

  it("is never one's own, and an owner's where it has to be", () => {
    expect(whyNotApprove('operator', ['anna'], person('bert'), 'arm')).toBeNull();
    expect(whyNotApprove('operator', ['olga', 'anna'], person('anna'), 'arm')).toContain('somebody else');
    expect(whyNotApprove('owner', ['anna'], person('bert', { owner_of: ['other'] }), 'arm')).toContain(
      'no owner',
    );
    expect(
      whyNotApprove('owner', ['anna'], person('olga', { role: 'owner', owner_of: ['arm'] }), 'arm'),
    ).toBeNull();
  });

  it('is not offered to who may only look, or whom nobody knows', () => {
    expect(whyNotApprove('operator', ['anna'], person('vera', { role: 'viewer' }), 'arm')).toContain(
      'operator',
    );
    expect(whyNotApprove('operator', ['anna'], person('local user', { is_known: false }), 'arm')).toContain(
      'token',
    );
    expect(whyNotApprove('operator', ['anna'], null, 'arm')).not.toBeNull();
  });
});
