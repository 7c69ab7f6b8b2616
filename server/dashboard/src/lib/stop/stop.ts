/**
 * One press of Stop: sent at once, sent again while nothing answers, and told in so many words within a second.
 *
 * Knows nothing about a browser: what sends, and what tells the time, is handed in.
 */

import type { StopResult } from '../api/types';

/** s after which an answer that has not come is told as none. The request stays on its way. */
export const TELL_AFTER = 1;
/** s between two requests while none is answered, and how many there are. */
export const AGAIN_AFTER = 1;
export const ATTEMPTS = 5;
export const EMERGENCY = 'Use the emergency stop.';

export type StopState =
  | { kind: 'none' }
  | { kind: 'sending' }
  /** The board has said that its set points are frozen. */
  | { kind: 'confirmed'; text: string; seconds: number }
  /** On the line, and nothing has come back. */
  | { kind: 'delivered'; text: string; seconds: number }
  | { kind: 'not delivered'; text: string };

export interface StopParts {
  send(): Promise<StopResult>;
  after(seconds: number, call: () => void): () => void;
  told(state: StopState): void;
}

/** What an answer of the service means. */
export function stateOf(result: StopResult): StopState {
  const { text, seconds } = result;
  if (result.confirmed) return { kind: 'confirmed', text, seconds };
  return result.delivered ? { kind: 'delivered', text, seconds } : { kind: 'not delivered', text };
}

export class StopCall {
  private timers: (() => void)[] = [];
  private attempts = 0;
  private ended = false;

  constructor(private readonly parts: StopParts) {}

  begin(): void {
    this.parts.told({ kind: 'sending' });
    this.timers.push(this.parts.after(TELL_AFTER, () => this.silent()));
    this.attempt();
  }

  /** Nothing more is told: another press has taken over. */
  leave(): void {
    this.ended = true;
    for (const cancel of this.timers) cancel();
  }

  private attempt(): void {
    this.attempts += 1;
    this.parts.send().then(
      (result) => this.answered(result),
      (error: unknown) => this.failed(error),
    );
    if (this.attempts < ATTEMPTS) this.timers.push(this.parts.after(AGAIN_AFTER, () => this.attempt()));
  }

  private answered(result: StopResult): void {
    if (this.ended) return;
    this.leave();
    this.parts.told(stateOf(result));
  }

  private failed(error: unknown): void {
    if (this.ended) return;
    const why = error instanceof Error ? error.message : String(error);
    const more = this.attempts < ATTEMPTS ? ' It is being sent again.' : '';
    this.parts.told({ kind: 'not delivered', text: `${sentence(why)} ${EMERGENCY}${more}` });
  }

  private silent(): void {
    if (this.ended) return;
    const text = `No answer within ${TELL_AFTER} s. ${EMERGENCY} It is being sent again.`;
    this.parts.told({ kind: 'not delivered', text });
  }
}

function sentence(text: string): string {
  const first = text.charAt(0).toUpperCase() + text.slice(1);
  return /[.!?]$/.test(first) ? first : `${first}.`;
}

/** Keys that stop, wherever the focus is, also in a form: F8, Pause. */
export function isStopKey(event: {
  key: string;
  ctrlKey: boolean;
  altKey: boolean;
  metaKey: boolean;
}): boolean {
  if (event.altKey || event.metaKey) return false;
  return event.key === 'F8' || event.key === 'Pause';
}
