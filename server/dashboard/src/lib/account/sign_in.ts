/** Signing in and out: which ways there are, what a refused sign-in means, and what a role may do. */

import { api, ask, asProblem, root } from '../api';
import { currentToken, keepToken } from '../api/token';
import type { LoginWays, Me } from '../api/types';

/** What the provider's way back says in the page's address when it has failed, by the problem's kind. */
const REFUSED: Readonly<Record<string, string>> = {
  'sign-in-unknown': 'This sign-in was used, is too old, or was begun in another browser. Begin anew.',
  'sign-in-refused': 'The provider refused to sign you in.',
  'sign-in-not-proven':
    'What the provider says about you could not be verified. The log of the service says why.',
  'no-role': 'You are known, but you have no role here. Ask whoever looks after the service.',
  'no-name': 'The provider does not say your name. Ask whoever looks after the service.',
  'name-taken': 'Somebody else has your name here. Ask whoever looks after the service.',
  'provider-away': 'The provider cannot be reached now. Try again, or use a token.',
};

/** Why a sign-in has failed, from the query of the page's address; empty if none has. */
export function problemOfSignIn(query: string): string {
  const kind = new URLSearchParams(query).get('sign-in');
  return kind === null
    ? ''
    : (REFUSED[kind] ?? 'You could not be signed in. The log of the service says why.');
}

/** The address at which signing in begins; afterwards the page shows this robot. */
export function signInAddress(start: string, robot: string): string {
  return robot === '' ? root + start : `${root}${start}?robot=${encodeURIComponent(robot)}`;
}

/** What a role may do, in a few words. */
export function roleText(role: Me['role'], isOwner: boolean): string {
  if (role === 'viewer') return 'viewer: looks, and stops';
  if (role === 'operator' || !isOwner) return 'operator: moves the arm; changes their own experiments';
  return `${role}: moves the arm; changes everybody’s experiments`;
}

export async function askLoginWays(): Promise<LoginWays> {
  return await ask(api.GET('/api/v1/login')).catch(() => ({ openid: null }));
}

/** Ends the session, forgets the token, and shows the sign-in. Why it could not, if it could not. */
export async function leave(): Promise<string> {
  let provider: string | null = null;
  if (currentToken() === null) {
    try {
      provider = (await ask(api.POST('/api/v1/logout'))).provider ?? null;
    } catch (error) {
      return asProblem(error).detail;
    }
  }
  keepToken(null);
  location.replace(provider ?? `${root}/`);
  return '';
}
