/** What the demonstration says. Pure. */

import type { Hidden, HiddenNumber, Job } from '../api/types';
import type { Tone } from '../jobs/jobs';
import { sentence, significant } from '../format';

type Outcome = NonNullable<Hidden['secret']>['outcome'];

export const OUTCOMES: Record<Outcome, { tone: Tone; title: string; text: string }> = {
  named: {
    tone: 'good',
    title: 'Found',
    text: 'The diagnosis named the hidden effect, alone and on its joint.',
  },
  among: {
    tone: 'warn',
    title: 'Among several',
    text: 'The hidden effect is in the group that the records leave open; the diagnosis does not pretend to know more.',
  },
  joint: { tone: 'warn', title: 'Right joint, wrong effect', text: 'It found where, and not what.' },
  missed: {
    tone: 'bad',
    title: 'Missed',
    text: 'The diagnosis named no effect. It may be too small for these records, or was taken for a number of the machine.',
  },
  wrong: {
    tone: 'bad',
    title: 'Wrong',
    text: 'The diagnosis named something else. It happens, and here it is.',
  },
  unanswered: {
    tone: 'quiet',
    title: 'No answer',
    text: 'The search ended before it had an answer. Candidates are those that led then.',
  },
};

/** The two numbers of a row, in the unit in which people read them; one of the mock's own has no unit, and no match. */
export function bothNumbers(one: HiddenNumber): { hidden: string; found: string; range: string } {
  const [factor, unit] = one.unit === 'rad' ? [180 / Math.PI, '°'] : [1, one.unit];
  const written = (value: number | null): string =>
    value === null ? '' : `${significant(value * factor)}${unit && unit !== '1' ? ` ${unit}` : ''}`;
  const isBounded = one.low !== null && one.high !== null;
  return {
    hidden: written(one.hidden),
    found: written(one.found) || (one.unit === '' ? 'not comparable' : 'not in the answer'),
    range: isBounded ? `95 %: ${significant(one.low! * factor)} to ${written(one.high)}` : '',
  };
}

/** How a visitor's guess compares. `joint`: null where none was guessed. */
export function guessWords(
  secret: Pick<NonNullable<Hidden['secret']>, 'effect' | 'joints'>,
  effect: string,
  joint: number | null,
): string {
  const isJoint = joint !== null && secret.joints.includes(joint);
  if (secret.effect !== effect) return isJoint ? 'the joint is right, the effect is not' : 'not this time';
  return isJoint || joint === null ? 'right' : 'the effect is right, the joint is not';
}

/** What goes on now, in one line. */
export function stageWords(
  hidden: Hidden | null,
  hasDrift: boolean,
  job: Pick<Job, 'state' | 'leading'> | null,
): string {
  if (hidden === null) return '';
  if (hidden.state === 'failed') return sentence(`The search failed: ${hidden.problem}`);
  if (hidden.state === 'opened') return 'The secret is open.';
  if (hidden.trace === null) return 'The mock moves: 55 s of motion, recorded in lock-step in a few seconds.';
  if (hidden.state === 'recording') return 'A second motion is recorded, which the search will not see.';
  if (!hasDrift) return 'The model simulates the same motion.';
  const now =
    job?.state === 'done'
      ? 'The answer is being read.'
      : (job?.leading ?? []).length > 0
        ? 'Candidates are tried and fitted.'
        : 'The records are checked first.';
  return `Which effect makes the arm differ from its model? ${now}`;
}
