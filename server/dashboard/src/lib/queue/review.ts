/** What the page says about the review of an experiment before it moves a real arm, and who may approve it. */

import type { Approval, Reviewer } from '../api/types';

/** One line; empty where no approval is needed and none was given. */
export function reviewText(needed: Reviewer | null, approval: Approval | null): string {
  if (needed === 'operator') return 'not approved: another operator must look at it';
  if (needed === 'owner') return 'not approved: another owner of the arm must look at it';
  return approval === null ? '' : `approved by ${approval.by}`;
}

/** Whether somebody may approve what belongs to `owner`. The service decides; this only spares a refusal. */
export function mayApprove(needed: Reviewer | null, owner: string, name: string, isOwner: boolean): boolean {
  return needed !== null && name !== owner && (needed === 'operator' || isOwner);
}
