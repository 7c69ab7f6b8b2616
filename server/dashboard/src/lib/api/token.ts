/** The token of a service that needs one: kept for this tab alone, and never in an address. */

const KEY = 'ma2000-token';

let token: string | null = sessionStorage.getItem(KEY);

export function currentToken(): string | null {
  return token;
}

export function keepToken(given: string | null): void {
  token = given;
  if (given === null) sessionStorage.removeItem(KEY);
  else sessionStorage.setItem(KEY, given);
}
