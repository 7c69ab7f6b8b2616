/** Signing out, and what a role may do. */

import { root } from '../api';
import { keepToken } from '../api/token';
import type { Me } from '../api/types';

/** What a role may do, in a few words. */
export function roleText(role: Me['role'], isOwner: boolean): string {
  if (role === 'viewer') return 'viewer: looks, and stops';
  if (role === 'operator' || !isOwner) return 'operator: moves the arm; changes their own experiments';
  return `${role}: moves the arm; changes everybody’s experiments`;
}

/** Forgets the token, and shows the sign-in. */
export function leave(): void {
  keepToken(null);
  location.replace(`${root}/`);
}
