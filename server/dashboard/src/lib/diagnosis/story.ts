/** A diagnosis as a story: what speaks for and against each candidate, how much it shrinks, where and when. Pure. */

import type { DiagnosisData, DiagnosisStep, Overlay, TriedEffect } from '../api/types';
import { driftOf, heatAt, timesNoiseAt, type Drift } from '../hidden/drift';
import { fixed, significant } from '../format';
import { key, namedIn, total } from './evidence';
import { shownUnit } from './overlay';

export interface Told {
  called: string;
  joint: number | null;
  /** 0 to 1, of all that were fitted: the posterior, if it is one of them. */
  share: number;
  evidence: number;
  named: boolean;
  speaksFor: string;
  speaksAgainst: string;
}

/** The first `most` fitted candidates of a step, the best first. `needed`: evidence from which an effect is named. */
export function toldOf(
  step: Pick<DiagnosisStep, 'candidates' | 'group' | 'effect' | 'joints'>,
  needed: number | null,
  most = 4,
): Told[] {
  const fitted = step.candidates
    .filter((one) => one.refitted)
    .sort((one, other) => total(other) - total(one));
  const best = fitted[0];
  if (best === undefined) return [];
  const weights = fitted.map((one) => Math.exp((total(one) - total(best)) / 2));
  const sum = weights.reduce((all, one) => all + one, 0);
  const named = namedIn(step);
  return fitted.slice(0, most).map((one, place) => {
    const lead = total(best) - total(place === 0 ? (fitted[1] ?? one) : one);
    return {
      called: one.called,
      joint: one.joints.length === 1 ? one.joints[0]! : null,
      share: weights[place]! / sum,
      evidence: total(one),
      named: named.has(key(one)),
      speaksFor:
        total(one) > 0
          ? `Evidence ${fixed(total(one), 0)}${needed === null || place > 0 ? '' : `; ${fixed(needed, 0)} is enough for a name`}.`
          : 'Nothing: it explains less than its numbers cost.',
      speaksAgainst: against(one, fitted, place, lead),
    };
  });
}

/** The candidates of an answer: of the step that it adopted, or of the first one. */
export function toldOfAnswer(found: DiagnosisData): Told[] {
  const step = found.steps.find((one) => one.adopted) ?? found.steps[0];
  return toldOf(
    step ?? { candidates: found.candidates, group: [], effect: null, joints: [] },
    found.significant,
  );
}

/** A share of the probability, for people. */
export function shareText(share: number): string {
  if (share > 0.999) return '> 99.9 %';
  return share < 0.001 ? '< 0.1 %' : `${fixed(100 * share, share < 0.1 ? 1 : 0)} %`;
}

function against(one: TriedEffect, fitted: readonly TriedEffect[], place: number, lead: number): string {
  const left =
    one.misfit === null || one.misfit < 1.1 ? '' : `leaves ${fixed(one.misfit, 2)} times the noise`;
  if (place === 0) {
    if (fitted.length < 2) return left ? `It ${left}.` : 'No other candidate was worth a fit.';
    const next = `the next best has ${fixed(lead, 0)} less`;
    return left ? `It ${left}; ${next}.` : `Nothing; ${next}.`;
  }
  const behind = lead < 1 ? 'As much evidence as the best' : `Evidence ${fixed(lead, 0)} below the best`;
  return left ? `${behind}, and ${left}.` : `${behind}.`;
}

export interface Shrunk {
  joint: number;
  unit: string;
  before: string;
  after: string;
  noise: string;
  /** Of the largest error of all joints in this unit: 0 to 1. */
  was: number;
  left: number;
  floor: number;
}

/** Of which simulation the errors of an answer are, where its steps were judged by another one; else empty. */
export function measureWords(found: Pick<DiagnosisData, 'notes_data'>): string {
  return found.notes_data?.some((one) => one.kind === 'errors-follow-record')
    ? 'Errors of the closed loop alone; the percentages of the answer are of the mean square error in a simulation that follows the record.'
    : '';
}

/** The error of each joint with the given and with the resulting model, and on which traces. */
export function shrunkOf(found: Pick<DiagnosisData, 'gap'>): { joints: Shrunk[]; isHeldOut: boolean } {
  const gap = found.gap;
  const [first, last] = [gap?.stages[0], gap?.stages.at(-1)];
  if (!gap || !first || !last) return { joints: [], isHeldOut: false };
  const isHeldOut = first.held_out.length > 0;
  const [before, after] = isHeldOut ? [first.held_out, last.held_out] : [first.fitted, last.fitted];
  const errors = gap.joints.map(
    (_, place) => [before[place] ?? null, after[place] ?? null, gap.noise[place] ?? 0] as const,
  );
  const joints = gap.joints.map((joint, place) => {
    const [factor, unit] = shownUnit(gap.units[place] ?? 'rad');
    const [from, to, noise] = errors[place]!;
    const alike = errors.filter((_, other) => gap.units[other] === gap.units[place]);
    const most = Math.max(...alike.flat().map((one) => one ?? 0)) || 1;
    return {
      joint,
      unit,
      before: significant(from === null ? null : from * factor, 2),
      after: significant(to === null ? null : to * factor, 2),
      noise: significant(noise * factor, 2),
      was: (from ?? 0) / most,
      left: (to ?? 0) / most,
      floor: noise / most,
    };
  });
  return { joints, isHeldOut };
}

/** A record with what its model did not explain, over time. */
export interface Scene {
  trace: string;
  isHeldOut: boolean;
  drift: Drift;
  /** By joint of the drift, in its unit. */
  noise: readonly number[];
  /** Whether the drift has postures: else torques or forces. */
  hasPosture: boolean;
}

/** The records of a diagnosis, positions before torques. */
export function scenesOf(found: Pick<DiagnosisData, 'signals' | 'efforts' | 'gap' | 'rmse_fit'>): Scene[] {
  const own = found.signals.length > 0 ? found.signals : (found.efforts ?? []);
  const noise = (joint: number): number => {
    const place = found.gap?.joints.indexOf(joint) ?? -1;
    return found.gap?.noise[place] ?? found.rmse_fit.find((one) => one.joint === joint)?.floor ?? 0;
  };
  return own.map((one: Overlay) => ({
    trace: one.trace,
    isHeldOut: one.held_out === true,
    drift: driftOf(one, Math.max(0.05, (one.time.at(-1) ?? 0) / 1200)),
    noise: one.joints.map(noise),
    hasPosture: found.signals.length > 0,
  }));
}

/** Heat of each joint in `count` stretches of a scene, without (`closed` 0) and with (1) what was found. */
export function heatOverTime(
  scene: Pick<Scene, 'drift' | 'noise'>,
  count: number,
  closed: number,
): number[][] {
  const heats = Array.from({ length: count }, (_, index) =>
    heatAt(scene.drift, scene.noise, ((index + 0.5) * scene.drift.duration) / count, closed),
  );
  return scene.drift.joints.map((_, joint) => heats.map((one) => one[joint]!));
}

/** Stretches of a record that are judged one by one. */
export const BINS = 120;
/** From this heat on a joint glows. */
export const GLOWS = 0.3;

/** How the arms move with the answer: alike, or which joints are still red at times. */
export function closedWords(scene: Pick<Scene, 'drift' | 'noise'>): string {
  const heats = heatOverTime(scene, BINS, 1);
  const red = scene.drift.joints.filter((_, place) => heats[place]!.some((heat) => heat > GLOWS));
  if (red.length === 0) return 'With the effect in the model the arms move alike: no joint is red any more.';
  const joints = `joint${red.length > 1 ? 's' : ''} ${red.join(' and ')} ${red.length > 1 ? 'are' : 'is'}`;
  return `With the effect in the model the arms move nearly alike: ${joints} still red at times.`;
}

/** Whether an answer changed the model: without a name it closes no gap. */
export function closesGap(found: Pick<DiagnosisData, 'steps' | 'signals'> | null): boolean {
  return (found?.signals[0]?.residual.length ?? 0) > 1 && found!.steps.some((one) => one.adopted);
}

/** The joints that an answer names; none where nothing was adopted. */
export function answeredJoints(found: Pick<DiagnosisData, 'steps'>): number[] {
  const adopted = found.steps.filter((one) => one.adopted);
  return [...new Set(adopted.flatMap((one) => one.joints))].sort((one, other) => one - other);
}

/** The middle of that of `count` stretches of a scene, s, in which `joints` are worst; all of them where none is there. */
export function worstMoment(scene: Scene, joints: readonly number[], count: number): number {
  const { drift, noise } = scene;
  const own = drift.joints.flatMap((joint, place) => (joints.includes(joint) ? [place] : []));
  const moments = Array.from({ length: count }, (_, index) => ((index + 0.5) * drift.duration) / count);
  const worst = moments.map((moment) => {
    const times = timesNoiseAt(drift, noise, moment, 0);
    return Math.max(...(own.length > 0 ? own.map((place) => times[place]!) : times));
  });
  return moments[worst.indexOf(Math.max(...worst))] ?? 0;
}

/** The joints to which the search was limited; undefined for all. */
export function examinedJoints(found: Pick<DiagnosisData, 'notes_data'>): readonly number[] | undefined {
  const note = found.notes_data?.find((one) => one.kind === 'limited-search');
  return (note?.values?.joints ?? undefined) as readonly number[] | undefined;
}

/** A joint is red if it glows in more than this share of a record. */
const OFTEN = 0.02;
/** The answer explains a joint if no more than this share of its red stretches is left. */
const HARDLY = 0.3;

/**
 * Why joints are red that are not those of the answer; empty where none is. `before`, `after`: heat of each joint of the
 * scene over time, with the given model and with the answer; `remaining`: joints with a torque that no known effect has.
 */
export function besideAnswer(
  { drift }: Pick<Scene, 'drift'>,
  answered: readonly number[],
  [before, after]: readonly (readonly (readonly number[])[])[],
  examined = drift.joints,
  remaining: readonly number[] = [],
): string {
  const red = (heats: readonly number[] | undefined): number =>
    (heats ?? []).filter((heat) => heat > GLOWS).length / (heats?.length || 1);
  const places = drift.joints.flatMap((joint, place) =>
    red(before?.[place]) > OFTEN && !answered.includes(joint) ? [place] : [],
  );
  const unseen = places.filter((one) => !examined.includes(drift.joints[one]!));
  if (places.length === 0 || (answered.length === 0 && unseen.length === 0)) return '';
  const called = (some: readonly number[]): string =>
    `Joint${some.length > 1 ? 's' : ''} ${some.map((place) => drift.joints[place]).join(' and ')}`;
  const notSeen = `${called(unseen)}: not explained, and not examined.`;
  if (answered.length === 0) return notSeen;
  if (after === undefined || drift.gap.length < 2)
    return `${called(places)} may be red because the joints push each other.`;
  const left = places.filter((one) => red(after[one]) > Math.max(OFTEN, HARDLY * red(before?.[one])));
  const gone = places.filter((place) => !left.includes(place));
  const seen = left.filter((place) => !unseen.includes(place));
  const torque = seen.some((place) => remaining.includes(drift.joints[place]!))
    ? ' “Unexplained torque” shows what is left.'
    : '';
  return [
    gone.length > 0
      ? `${called(gone)}: no longer red with the answer and the numbers that were fitted with it.`
      : '',
    seen.length > 0
      ? `${called(seen)}: the answer explains it only in part, and nothing else was named.${torque}`
      : '',
    left.length > seen.length ? notSeen : '',
  ]
    .filter((sentence) => sentence !== '')
    .join(' ');
}
