/** Where an experiment stands that somebody has just sent. Pure. */

import type { Experiment } from '../api';

export interface Lists {
  readonly waiting: readonly Experiment[];
  readonly running: Experiment | null;
  readonly ended: readonly Experiment[];
}

export interface StandingOfRun {
  /** `unknown`: the lists have not been read since it was sent. */
  state: 'unknown' | 'waiting' | 'running' | 'ended';
  experiment: Experiment | null;
  tone: 'good' | 'warn' | 'bad' | 'busy' | 'quiet';
  text: string;
  /** For one that waits: what it waits behind. */
  said: string;
}

const TONES = {
  done: 'good',
  failed: 'bad',
  cancelled: 'quiet',
  stopped: 'warn',
  interrupted: 'warn',
} as const;

/** How an experiment stands, in a word: one that was cancelled while it ran has left a part of its trace. */
export const endOf = ({ state, outcome }: Experiment): string =>
  state === 'cancelled' && outcome === 'stopped' ? 'stopped' : state;

/** How an experiment has ended, as a tone. */
export const toneOf = (ended: Experiment): StandingOfRun['tone'] =>
  TONES[endOf(ended) as keyof typeof TONES] ?? 'quiet';

export function standingOf(id: string, { waiting, running, ended }: Lists): StandingOfRun {
  const over = ended.find((one) => one.id === id);
  if (over !== undefined) {
    return { state: 'ended', experiment: over, tone: toneOf(over), text: endOf(over), said: '' };
  }
  if (running?.id === id)
    return { state: 'running', experiment: running, tone: 'busy', text: 'running', said: '' };
  const place = waiting.findIndex((one) => one.id === id);
  if (place === -1)
    return { state: 'unknown', experiment: null, tone: 'quiet', text: 'added to the queue', said: '' };
  const ahead = [
    ...(running === null ? [] : ['the one that is running']),
    ...(place === 0 ? [] : [place === 1 ? 'one that waits' : `${place} that wait`]),
  ];
  return {
    state: 'waiting',
    experiment: waiting[place]!,
    tone: 'quiet',
    text: place === 0 ? 'next in the queue' : `number ${place + 1} in the queue`,
    said: ahead.length === 0 ? 'It is next.' : `It runs after ${ahead.join(' and ')}.`,
  };
}

/** Of those that have ended, the newest first: the newest that failed, unless one succeeded after it. */
export function troubleOf(ended: readonly Experiment[]): Experiment | null {
  const last = ended.find((one) => one.state !== 'cancelled');
  return last !== undefined && last.state !== 'done' ? last : null;
}
