/** A stop in words: what became of it, and whether that still holds. Pure. */

import { sentence } from '../format';
import type { ArmNow, Standing } from './standing';
import type { StopState } from './stop';

const UNKNOWN = 'How the arm is now is not known.';

export interface StopWords {
  /** Of which kind the message is: its colour and its sign follow from it. */
  look: 'sending' | 'confirmed' | 'delivered' | 'not-delivered' | 'past';
  sign: string;
  head: string;
  text: string;
}

/** The message about a stop, told at `time` (of day); null where there is none. */
export function wordsOf(state: StopState, standing: Standing, arm: ArmNow, time: string): StopWords | null {
  if (state.kind === 'none') return null;
  if (state.kind === 'sending') return { look: 'sending', sign: '◐', head: 'Stop is being sent', text: '' };
  if (standing === 'past') return pastOf(state.kind, arm, time);
  const text = sentence(state.text);
  if (state.kind === 'not delivered' && standing === 'answered') {
    const now = 'The service answers again: press Stop again, or use the emergency stop.';
    return { look: 'not-delivered', sign: '✕', head: `The stop of ${time} was NOT DELIVERED`, text: now };
  }
  if (state.kind === 'not delivered') {
    return { look: 'not-delivered', sign: '✕', head: 'Stop NOT DELIVERED', text };
  }
  const after = `after ${Math.round(state.seconds * 1000)} ms`;
  if (state.kind === 'delivered') {
    return { look: 'delivered', sign: '▲', head: `Stop sent, NOT CONFIRMED ${after}`, text };
  }
  if (standing === 'unknown') {
    const head = `Stopped at ${time}, confirmed by the board then`;
    return { look: 'delivered', sign: '▲', head, text: UNKNOWN };
  }
  return { look: 'confirmed', sign: '✓', head: `Stopped at ${time}, confirmed by the board ${after}`, text };
}

function pastOf(kind: 'confirmed' | 'delivered' | 'not delivered', arm: ArmNow, time: string): StopWords {
  if (kind === 'confirmed') {
    const head = `Past: stopped at ${time}, confirmed by the board`;
    return { look: 'past', sign: '○', head, text: 'That stop has been ended since.' };
  }
  const what = kind === 'delivered' ? 'was sent and NOT CONFIRMED' : 'was NOT DELIVERED';
  const now = {
    stopped: 'The arm is stopped now.',
    free: 'The arm is not stopped now. Press Stop to stop it.',
    unknown: UNKNOWN,
    unheard: UNKNOWN,
  }[arm];
  return {
    look: 'past',
    sign: arm === 'stopped' ? '○' : '▲',
    head: `Past: the stop of ${time} ${what}`,
    text: now,
  };
}
