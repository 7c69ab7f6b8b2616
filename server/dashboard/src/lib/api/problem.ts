/** What went wrong with a request, in the words of the service, and what to do about it. */

import type { components } from './schema';

type ProblemDetails = components['schemas']['ProblemDetails'];

export interface FieldProblem {
  field: string;
  message: string;
}

export class Problem extends Error {
  constructor(
    /** 0 where the service did not answer at all. */
    readonly status: number,
    readonly kind: string,
    readonly detail: string,
    readonly advice: string = '',
    readonly fields: readonly FieldProblem[] = [],
  ) {
    super(detail);
    this.name = 'Problem';
  }
}

export const NOT_ANSWERED = 'not-answered';

/** The service did not answer. */
export function notAnswered(): Problem {
  return new Problem(
    0,
    NOT_ANSWERED,
    'the service does not answer',
    'Check that “daq serve” runs on its computer, and the network.',
  );
}

/** The problem in the body of an answer. */
export function problemOf(status: number, body: unknown): Problem {
  if (typeof body !== 'object' || body === null || !('detail' in body)) {
    return new Problem(status, 'http', `the service answered ${status}`);
  }
  const details = body as ProblemDetails;
  const kind = details.type.split('#').at(-1) ?? details.type;
  return new Problem(status, kind, details.detail, details.advice ?? '', details.fields ?? []);
}

/** What browsers throw where nobody has answered: Chromium, Firefox, Safari. */
const UNANSWERED = /^(failed to fetch|networkerror when attempting to fetch resource|load failed)\.?$/i;

/** Anything that was thrown, as a problem. What the page has thrown with words of its own is told in them alone. */
export function asProblem(error: unknown): Problem {
  if (error instanceof Problem) return error;
  const text = error instanceof Error ? error.message : String(error);
  if (error instanceof TypeError && UNANSWERED.test(text)) return notAnswered();
  const isFault = !(error instanceof Error) || error.name !== 'Error';
  return new Problem(0, 'fault', text, isFault ? 'load the page again' : '');
}
