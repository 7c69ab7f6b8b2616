/**
 * One press of Stop: sent at once, sent again while nothing answers, and told in so many words within a second.
 *
 * The service has two doors for it: its own, and a listener that opens also while the rest of the service hangs. Knows
 * nothing about a browser: what sends, and what tells the time, is handed in.
 */

import { asProblem } from '../api/problem';
import type { StopResult } from '../api/types';
import { sentence } from '../format';

/** s after which an answer that has not come is told as none. Requests stay on their way. */
export const TELL_AFTER = 0.8;
/** s between two requests while none is answered, each through the next door, and how many there are. */
export const AGAIN_AFTER = 0.25;
export const ATTEMPTS = 12;
export const EMERGENCY = 'Use the emergency stop.';

/** `text`: what is known beyond the kind. */
export type StopState =
  | { kind: 'none' }
  | { kind: 'sending' }
  /** The board has said that its set points are frozen. */
  | { kind: 'confirmed'; text: string; seconds: number }
  /** On the line, and the board has not said so. */
  | { kind: 'delivered'; text: string; seconds: number }
  | { kind: 'not delivered'; text: string };

export interface StopParts {
  /** Each sends one request. */
  doors: readonly (() => Promise<StopResult>)[];
  after(seconds: number, call: () => void): () => void;
  told(state: StopState): void;
}

/** What an answer of the service means. */
export function stateOf(result: StopResult): StopState {
  const { detail: text, seconds } = result;
  if (result.confirmed) return { kind: 'confirmed', text, seconds };
  return result.delivered ? { kind: 'delivered', text, seconds } : { kind: 'not delivered', text };
}

export class StopCall {
  private timers: (() => void)[] = [];
  private attempts = 0;
  private failures = 0;
  private ended = false;
  /** Why nobody has taken it, once that has been told. */
  private undelivered = '';

  constructor(private readonly parts: StopParts) {}

  begin(): void {
    this.parts.told({ kind: 'sending' });
    this.timers.push(this.parts.after(TELL_AFTER, () => this.silent()));
    this.attempt();
  }

  /** Nothing more is sent or told: another press has taken over, or the message was read. */
  leave(): void {
    this.ended = true;
    for (const cancel of this.timers) cancel();
  }

  private attempt(): void {
    if (this.ended) return;
    const door = this.parts.doors[this.attempts % this.parts.doors.length];
    this.attempts += 1;
    door?.().then(
      (result) => this.answered(result),
      (error: unknown) => this.failed(error),
    );
    if (this.attempts < ATTEMPTS) this.timers.push(this.parts.after(AGAIN_AFTER, () => this.attempt()));
    else if (this.undelivered !== '') this.tellUndelivered(this.undelivered);
  }

  private answered(result: StopResult): void {
    if (this.ended) return;
    this.leave();
    this.parts.told(stateOf(result));
  }

  /** One door that is closed is no answer: what counts is whether all are. */
  private failed(error: unknown): void {
    this.failures += 1;
    if (this.ended || this.failures < this.parts.doors.length) return;
    this.tellUndelivered(sentence(asProblem(error).detail));
  }

  private silent(): void {
    if (!this.ended) this.tellUndelivered(`The service has not answered within ${TELL_AFTER} s.`);
  }

  private tellUndelivered(why: string): void {
    this.undelivered = why;
    this.parts.told({ kind: 'not delivered', text: `${why} ${EMERGENCY} ${this.prospect()}` });
  }

  /** What may still come of it: said anew when the last request has been sent, and when the last has failed. */
  private prospect(): string {
    if (this.attempts < ATTEMPTS) return 'It is being sent again.';
    const left = this.failures < ATTEMPTS ? ', and an earlier one may still arrive' : '';
    return `Nothing is being sent now${left}. Press Stop again.`;
  }
}

/** Keys that stop, wherever the focus is, also in a form: F8, Pause. */
export function isStopKey(event: { key: string; altKey: boolean; metaKey: boolean }): boolean {
  return !event.altKey && !event.metaKey && (event.key === 'F8' || event.key === 'Pause');
}
