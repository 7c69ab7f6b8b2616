/** The experiment that is being written: its fields, what is wrong with them, and the motion it would make. */

import {
  api,
  ask,
  here,
  type ExperimentPreset,
  type ExperimentSpec,
  type MotionPreview,
  type Problem,
} from '../../lib/api';
import { previewOf } from '../../lib/queue/submit';
import { afterSeconds } from '../../lib/reload/reload';
import { MotionCheck, type Check } from '../../lib/trajectory/check';
import type { Schema, TrajectoryKind } from '../../lib/trajectory/fields';
import {
  formField,
  formOf,
  nameOfChanged,
  rulesOf,
  specOf,
  withKind,
  type FormResult,
  type Slides,
  type Spec,
  type SpecForm,
  type SpecRules,
} from '../../lib/trajectory/form';

export class Draft {
  form: SpecForm = $state()!;
  /** The preset that the fields were filled with, while nothing has been changed. */
  preset = $state('');
  /** What the service says to what is in the fields now. */
  check = $state.raw<Check<MotionPreview>>({ state: 'unreadable' });
  /** The last motion that the service worked out; of what is in the fields only while `isCurrent`. */
  motion = $state.raw<MotionPreview | null>(null);
  isCurrent: boolean = $derived(this.check.state === 'checked');
  /** Why the service cannot work out the motion. */
  problem: Problem | null = $derived(this.check.state === 'failed' ? this.check.problem : null);
  /** The specification as text, while it is edited so; the fields wait meanwhile. */
  text = $state<string | null>(null);
  result: FormResult = $derived.by(() =>
    this.text === null ? specOf($state.snapshot(this.form), this.rules, this.slides) : parsed(this.text),
  );
  /** By field, whoever found it: this page or the service. */
  problems: Readonly<Record<string, string>> = $derived.by(() => ({
    ...this.told(),
    ...this.result.problems,
  }));
  /** Those but for a name, which moves nothing. */
  wrongInMotion = $derived(
    Object.fromEntries(Object.entries(this.problems).filter(([field]) => field !== 'name')),
  );
  /** The name that the form has by itself, the name without what was changed, and what it is changed from. */
  private given = '';
  private base = '';
  private before!: SpecForm;
  private readonly checking = new MotionCheck<ExperimentSpec, MotionPreview>({
    ask: previewOf,
    after: afterSeconds,
    told: (check) => this.hear(check),
  });

  constructor(
    readonly rules: SpecRules,
    readonly presets: readonly ExperimentPreset[],
    readonly slides: Slides,
  ) {
    this.fill(presets[0]!.name);
  }

  /** Asks the service for presets, rules and machine. Throws a Problem. */
  static async load(): Promise<Draft> {
    const params = { path: here() };
    const [presets, schema, machine] = await Promise.all([
      ask(api.GET('/api/v1/robots/{robot}/presets', { params })),
      ask(api.GET('/api/v1/robots/{robot}/spec-schema', { params })),
      ask(api.GET('/api/v1/robots/{robot}/machine', { params })),
    ]);
    const slides: Slides = (joint) => machine.joints[joint - 1]?.kind === 'prismatic';
    return new Draft(rulesOf(schema as Schema), presets, slides);
  }

  fill(preset: string): void {
    const found = this.presets.find((one) => one.name === preset);
    if (found) this.take(found.spec as unknown as Spec);
    this.preset = preset;
  }

  take(spec: Partial<Spec>): void {
    this.preset = '';
    this.form = formOf(spec, this.rules, this.slides);
    this.begin();
    if (this.text !== null) this.text = written(spec);
  }

  /** Fills the form for another kind of motion. */
  choose(kind: TrajectoryKind): void {
    const given = [...this.presets.map((one) => one.spec.name ?? one.name), this.given];
    this.form = withKind($state.snapshot(this.form), kind, given, this.slides);
    this.begin();
  }

  /** Names it after what has been changed, unless somebody chose its name: for an effect. */
  rename(): void {
    const form = $state.snapshot(this.form);
    if (this.text !== null || this.result.spec === null || form.name !== this.given) return;
    this.form.name = this.given = nameOfChanged(this.base, form, this.before, this.slides);
  }

  /** What changes are told of: the preset whose name the form has, or what is in the form now. */
  private begin(): void {
    const form = $state.snapshot(this.form);
    this.given = this.base = form.name;
    this.before = form;
    for (const { name, spec } of this.presets) {
      const preset = formOf(spec as unknown as Spec, this.rules, this.slides);
      const isOfPreset = form.name === name || form.name === nameOfChanged(name, form, preset, this.slides);
      if (isOfPreset && form.kind === preset.kind) [this.base, this.before] = [name, preset];
    }
  }

  /** Why it cannot change between fields and text now; empty where it can. What cannot be read would be lost. */
  keptFromChanging: string = $derived.by(() => {
    if (this.text === null) return this.result.spec === null ? 'first correct the fields that are wrong' : '';
    return this.result.spec !== null && this.isCurrent ? '' : 'first correct the text';
  });

  /** Edits the specification as text instead of its fields, or its fields again. */
  change(): void {
    const spec = this.result.spec;
    if (spec === null || this.keptFromChanging !== '') return;
    if (this.text === null) {
      this.text = written(spec);
      return;
    }
    const preset = this.preset;
    this.text = null;
    this.take(spec);
    this.preset = preset;
  }

  get spec(): ExperimentSpec | null {
    return this.result.spec as unknown as ExperimentSpec | null;
  }

  /** Has the motion checked when typing has paused: for an effect that follows what is in the fields. */
  checkSoon(): () => void {
    this.checking.changed(this.result.motion as unknown as ExperimentSpec | null);
    return () => this.checking.leave();
  }

  private hear(check: Check<MotionPreview>): void {
    this.check = check;
    if (check.state === 'checked') this.motion = check.motion;
    if (check.state === 'failed') this.motion = null;
  }

  private told(): Record<string, string> {
    if (this.problem === null) return {};
    return Object.fromEntries(this.problem.fields.map((one) => [formField(one.field), one.message]));
  }
}

function written(spec: Partial<Spec>): string {
  return JSON.stringify(spec, null, 2);
}

function parsed(text: string): FormResult {
  try {
    const spec = JSON.parse(text) as Spec;
    return { spec, motion: spec, problems: {} };
  } catch (error) {
    return {
      spec: null,
      motion: null,
      problems: { text: error instanceof Error ? error.message : String(error) },
    };
  }
}
