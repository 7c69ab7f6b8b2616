/** When an experiment is to be run, and handing it to the service: once, however often the button is pressed. */

import {
  asProblem,
  newKey,
  Problem,
  type Experiment,
  type ExperimentSpec,
  type Schedule,
} from '../../lib/api';
import { addSchedule, addToQueue, schedules, toldQueued, toldScheduled } from '../../lib/queue/submit';
import { typedNumber, type NumberRule } from '../../lib/trajectory/numbers';
import {
  cronOf,
  isSameTime,
  localMoment,
  momentOf,
  ruleOf,
  UNITS,
  type Unit,
} from '../../lib/trajectory/when';

export type When = 'now' | 'at' | 'daily' | 'every';

const whole = (low: number, high: number): NumberRule => ({
  bounds: { low, high, above: false },
  unit: '',
  scale: 1,
  integer: true,
});
const PRIORITY = whole(-100, 100);
const COUNT = whole(1, 1_000_000);
const SHORTEST = 10;
const LONGEST = 366 * UNITS.d;

export class Sending {
  when = $state<When>('now');
  /** Value of a `datetime-local` field. */
  at = $state(localMoment(new Date(Date.now() + 10 * 60_000)));
  /** The same for the first run of a schedule; empty for at once. */
  starts = $state('');
  /** Time of day, at the arm's computer. */
  daily = $state('');
  /** Weekdays by cron's numbers: none before a person has chosen them. */
  days = $state<number[]>([]);
  every = $state('30');
  unit = $state<Unit>('min');
  count = $state('10');
  priority = $state('0');
  busy = $state(false);
  problem = $state.raw<Problem | null>(null);
  /** What became of the last one. */
  done = $state('');
  /** The last one as it is in the queue; null for a schedule. */
  made: Experiment | null = null;
  problems: Readonly<Record<string, string>> = $derived.by(() => this.wrong());
  /** A schedule moves the arm by itself: what it would do, for a person to confirm; null before it was asked for. */
  confirming = $state.raw<{ text: string; of: string } | null>(null);
  private key = newKey();

  /** Whether it is to be run again and again. */
  get isSchedule(): boolean {
    return this.when === 'daily' || this.when === 'every';
  }

  /** All that the fields say: another text when one is changed. */
  get wanted(): string {
    const { when, at, starts, daily, days, every, unit, count, priority } = this;
    return JSON.stringify([when, at, starts, daily, days, every, unit, count, priority]);
  }

  /** Sends it. Whether it was taken; `problem` says why not. */
  async send(spec: ExperimentSpec): Promise<boolean> {
    if (this.busy) return false;
    this.busy = true;
    this.problem = null;
    this.done = '';
    this.made = null;
    try {
      this.done = this.isSchedule ? await this.schedule(spec) : await this.submit(spec);
      this.key = newKey();
      return true;
    } catch (error) {
      this.problem = asProblem(error);
      // Only a request without an answer is the same one when it is sent again.
      if (this.problem.status !== 0) this.key = newKey();
      return false;
    } finally {
      this.busy = false;
    }
  }

  private async submit(spec: ExperimentSpec): Promise<string> {
    const at = this.when === 'at' ? momentOf(this.at) : null;
    const more = { priority: Number(this.priority), ...(at === null ? {} : { at }) };
    this.made = await addToQueue(spec, this.key, more);
    return toldQueued(this.made);
  }

  private async schedule(spec: ExperimentSpec): Promise<string> {
    const { cron, every } = this.rule();
    const when = cron === null ? { every: every!, starts: momentOf(this.starts) } : { cron };
    const { runs: count } = this;
    return toldScheduled(await addSchedule(spec, { ...when, count, priority: Number(this.priority) }));
  }

  /**
   * Whether a schedule may be sent: it was shown to a person as it is now. Refuses one that is there already; `isAlike`
   * tells whether a schedule moves what is in the form.
   */
  async isConfirmed(spec: ExperimentSpec, isAlike: (one: Schedule) => boolean): Promise<boolean> {
    if (!this.isSchedule) return true;
    const rule = this.rule();
    const of = JSON.stringify([spec, this.wanted]);
    if (this.confirming?.of === of) {
      this.confirming = null;
      return true;
    }
    [this.problem, this.done, this.confirming] = [null, '', null];
    try {
      const there = (await schedules()).find(
        (one) => one.active && one.next !== null && isSameTime(one, rule) && isAlike(one),
      );
      if (there) {
        this.problem = new Problem(
          409,
          'planned',
          `it is planned already: ${ruleOf(there)}, by ${there.created_by}`,
        );
        return false;
      }
      const when =
        rule.cron === null ? ruleOf(rule) : ruleOf({ ...rule, zone: 'clock of the arm’s computer' });
      const joints = spec.joints ?? [];
      const kind = spec.name ?? (spec.trajectory?.kind ?? 'the motion').replaceAll('_', ' ');
      const what =
        joints.length === 0 ? kind : `${kind} of joint${joints.length > 1 ? 's' : ''} ${joints.join(', ')}`;
      const { runs } = this;
      const end = runs === null ? 'without an end' : `${runs} run${runs > 1 ? 's' : ''} and then no more`;
      this.confirming = { of, text: `${what} would start by itself ${when}, ${end}` };
    } catch (error) {
      this.problem = asProblem(error);
    }
    return false;
  }

  /** Null for no end. */
  private get runs(): number | null {
    return this.count.trim() === '' ? null : Number(this.count);
  }

  private rule(): { cron: string | null; every: number | null } {
    return this.when === 'daily'
      ? { cron: cronOf(this.daily, this.days), every: null }
      : { cron: null, every: this.seconds() };
  }

  private seconds(): number {
    return Number(this.every.replace(',', '.')) * UNITS[this.unit];
  }

  private wrong(): Record<string, string> {
    const problems: Record<string, string> = {};
    const { problem } = typedNumber(this.priority, PRIORITY);
    if (problem) problems.priority = problem;
    if (this.when === 'at' && momentOf(this.at) === null) problems.at = 'a day and a time are needed';
    if (this.when === 'daily' && this.daily === '') problems.daily = 'a time is needed';
    if (this.when === 'daily' && this.days.length === 0) problems.days = 'choose at least one day';
    if (this.isSchedule) {
      const every = this.seconds();
      if (this.when === 'every' && !(every >= SHORTEST && every <= LONGEST))
        problems.every = 'allowed: 10 s to 366 d';
      const count = this.count.trim() === '' ? '' : typedNumber(this.count, COUNT).problem;
      if (count) problems.count = count;
    }
    return problems;
  }
}
