/** What the page says about the review of an experiment before it moves a real arm, and who may approve it. */

import type { Approval, Me, Reviewer } from '../api/types';

/** One line; empty where no approval is needed and none was given. */
export function reviewText(needed: Reviewer | null, approval: Approval | null): string {
  if (needed === 'operator') return 'not approved: another operator must look at it';
  if (needed === 'owner') return 'not approved: another owner of the arm must look at it';
  return approval === null ? '' : `approved by ${approval.by}`;
}

/**
 * Why somebody cannot approve what `authors` own, submitted or changed; null if they can. The service decides: this
 * only spares them a refusal, and says beforehand what to do.
 */
export function whyNotApprove(
  needed: Reviewer,
  authors: readonly string[],
  me: Me | null,
  robot: string,
): string | null {
  if (me === null || me.role === 'viewer')
    return 'You may look, and stop the arm; only an operator approves.';
  if (needed === 'owner' && !me.owner_of.includes(robot)) return 'You are no owner of the arm: ask one.';
  if (me.is_known === false) {
    return 'To approve it, sign in or give a token: without one, nobody can tell you from whoever submitted it.';
  }
  if (authors.includes(me.name)) return 'You submitted or changed it: somebody else must approve it.';
  return null;
}
