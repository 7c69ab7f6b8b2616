/**
 * Whether the service has checked the motion that is in the fields. Only its answer to exactly that motion counts: an
 * answer to what was in the fields before says nothing. Knows nothing about a browser: who asks and who tells the time
 * is handed in.
 */

import { asProblem, type Problem } from '../api/problem';
import { labelOf } from './fields';

/** s without a key before the service is asked. */
export const QUIET = 0.25;

export type Check<Motion> =
  /** There is nothing that could be checked: what is in the fields is no specification. */
  | { readonly state: 'unreadable' }
  | { readonly state: 'checking' }
  | { readonly state: 'checked'; readonly motion: Motion }
  /** The service refused to work it out, or did not answer. */
  | { readonly state: 'failed'; readonly problem: Problem };

export interface CheckParts<Spec, Motion> {
  /** Asks the service. May throw. */
  ask(spec: Spec): Promise<Motion>;
  after(seconds: number, call: () => void): () => void;
  told(check: Check<Motion>): void;
}

export class MotionCheck<Spec, Motion> {
  private asked = 0;
  private cancelTimer: () => void = () => {};

  constructor(private readonly parts: CheckParts<Spec, Motion>) {}

  /** The fields have changed; `spec` is null where they cannot be read. An answer that is still to come is too late. */
  changed(spec: Spec | null): void {
    this.leave();
    if (spec === null) {
      this.parts.told({ state: 'unreadable' });
      return;
    }
    this.parts.told({ state: 'checking' });
    const turn = this.asked;
    this.cancelTimer = this.parts.after(QUIET, () => void this.check(spec, turn));
  }

  /** Nothing more is asked or told of what was in the fields. */
  leave(): void {
    this.asked += 1;
    this.cancelTimer();
  }

  private async check(spec: Spec, turn: number): Promise<void> {
    let found: Check<Motion>;
    try {
      found = { state: 'checked', motion: await this.parts.ask(spec) };
    } catch (error) {
      found = { state: 'failed', problem: asProblem(error) };
    }
    if (turn === this.asked) this.parts.told(found);
  }
}

/** What decides whether the motion may be sent. */
export interface Standing {
  readonly check: Check<{ readonly violations: readonly unknown[] }>;
  /** What is wrong, by field: those that need another value. */
  readonly wrong: Readonly<Record<string, string>>;
  /** Whether the service can be reached now. */
  readonly isConnected: boolean;
}

export interface Told {
  readonly tone: 'good' | 'warn' | 'bad' | 'busy';
  readonly text: string;
}

/** The word above a preview. */
export function toldOf({ check, wrong, isConnected }: Standing): Told {
  const fields = Object.keys(wrong).map(calledField);
  if (fields.length > 0)
    return { tone: 'warn', text: `not checked: ${fields[0]} needs another value${others(fields)}` };
  if (!isConnected) return { tone: 'warn', text: 'not checked: no connection' };
  switch (check.state) {
    case 'unreadable':
      return { tone: 'warn', text: 'not checked: it cannot be read' };
    case 'checking':
      return { tone: 'busy', text: 'checking' };
    case 'failed':
      return { tone: 'warn', text: 'not checked' };
    case 'checked': {
      const broken = check.motion.violations.length;
      if (broken === 0) return { tone: 'good', text: 'motion within its limits' };
      return { tone: 'bad', text: `${broken} limit${broken > 1 ? 's' : ''} broken` };
    }
  }
}

/** Why the motion may not be sent; empty when it may. */
export function hindranceOf({ check, wrong, isConnected }: Standing): string {
  const [first] = Object.entries(wrong);
  if (first) return `${calledField(first[0])}: ${first[1]}${others(Object.keys(wrong))}`;
  if (!isConnected) return 'the service cannot be reached: nothing can be sent';
  switch (check.state) {
    case 'unreadable':
      return 'what is written cannot be read';
    case 'checking':
      return 'the motion is being checked';
    case 'failed':
      return `the motion is not checked: ${check.problem.detail}`;
    case 'checked':
      return check.motion.violations.length > 0 ? 'this motion would break a limit: see the preview' : '';
  }
}

/** Labels in the form of fields that are called otherwise in the specification. */
const CALLED: Readonly<Record<string, string>> = {
  settle: 'Hold before',
  hold: 'Hold after',
  at: 'Not before',
  daily: 'Time',
  count: 'Number of runs',
  starts: 'First run',
};

/** A field as the form calls it: `trajectory.amplitude.2` is “Amplitude”. */
function calledField(field: string): string {
  const name = field.split('.').findLast((part) => !/^\d+$/.test(part)) ?? field;
  return CALLED[name] ?? labelOf(name);
}

function others(fields: readonly string[]): string {
  return fields.length > 1 ? `; ${fields.length - 1} more` : '';
}
