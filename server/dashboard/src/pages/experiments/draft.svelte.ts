/** The experiment that is being written: its fields, what is wrong with them, and the motion it would make. */

import {
  api,
  ask,
  asProblem,
  here,
  type ExperimentPreset,
  type ExperimentSpec,
  type MotionPreview,
  type Problem,
} from '../../lib/api';
import type { Schema } from '../../lib/trajectory/fields';
import {
  formField,
  formOf,
  rulesOf,
  specOf,
  type FormResult,
  type Spec,
  type SpecForm,
  type SpecRules,
} from '../../lib/trajectory/form';

/** ms without a key before the motion is asked for. */
const QUIET = 250;

export class Draft {
  form: SpecForm = $state()!;
  /** The preset that the fields were filled with, while nothing has been changed. */
  preset = $state('');
  motion = $state.raw<MotionPreview | null>(null);
  /** Why the service cannot work out the motion. */
  problem = $state.raw<Problem | null>(null);
  /** Whether `motion` is that of what is in the fields now. */
  isCurrent = $state(false);
  /** The specification as text, while it is edited so; the fields wait meanwhile. */
  text = $state<string | null>(null);
  result: FormResult = $derived.by(() =>
    this.text === null ? specOf($state.snapshot(this.form), this.rules) : parsed(this.text),
  );
  /** By field, whoever found it: this page or the service. */
  problems: Readonly<Record<string, string>> = $derived.by(() => ({
    ...this.told(),
    ...this.result.problems,
  }));
  private asked = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    readonly rules: SpecRules,
    readonly presets: readonly ExperimentPreset[],
  ) {
    this.fill(presets[0]!.name);
  }

  /** Asks the service for presets and rules. Throws a Problem. */
  static async load(): Promise<Draft> {
    const params = { path: here() };
    const [presets, schema] = await Promise.all([
      ask(api.GET('/api/v1/robots/{robot}/presets', { params })),
      ask(api.GET('/api/v1/robots/{robot}/spec-schema', { params })),
    ]);
    return new Draft(rulesOf(schema as Schema), presets);
  }

  fill(preset: string): void {
    const found = this.presets.find((one) => one.name === preset);
    if (found) this.take(found.spec as unknown as Spec);
    this.preset = preset;
  }

  take(spec: Partial<Spec>): void {
    this.preset = '';
    this.form = formOf(spec, this.rules);
    if (this.text !== null) this.text = written(spec);
  }

  /** Begins to edit the specification as text. */
  toText(): void {
    this.text = written(this.result.spec ?? {});
  }

  /** Back to the fields. Whether that was possible: only a specification that the service accepts has fields. */
  toFields(): boolean {
    const spec = this.result.spec;
    if (spec === null || !this.isCurrent || this.motion === null) return false;
    const preset = this.preset;
    this.text = null;
    this.take(spec);
    this.preset = preset;
    return true;
  }

  get spec(): ExperimentSpec | null {
    return this.result.spec as unknown as ExperimentSpec | null;
  }

  /** Whether it may be sent: checked by the service, and nothing speaks against it. */
  get isAllowed(): boolean {
    return this.isCurrent && this.motion !== null && this.motion.violations.length === 0;
  }

  /** Works the motion out anew when typing has paused; for an effect that follows `result`. */
  previewSoon(spec: ExperimentSpec | null): () => void {
    this.isCurrent = false;
    clearTimeout(this.timer);
    if (spec === null) return () => {};
    this.timer = setTimeout(() => void this.preview(spec), QUIET);
    return () => clearTimeout(this.timer);
  }

  private async preview(spec: ExperimentSpec): Promise<void> {
    const turn = ++this.asked;
    try {
      const body = { spec, priority: 0 };
      const motion = await ask(
        api.POST('/api/v1/robots/{robot}/experiments/preview', { params: { path: here() }, body }),
      );
      if (turn !== this.asked) return;
      this.motion = motion;
      this.problem = null;
    } catch (error) {
      if (turn !== this.asked) return;
      this.motion = null;
      this.problem = asProblem(error);
    }
    this.isCurrent = true;
  }

  private told(): Record<string, string> {
    if (!this.isCurrent || this.problem === null) return {};
    return Object.fromEntries(this.problem.fields.map((one) => [formField(one.field), one.message]));
  }
}

function written(spec: Partial<Spec>): string {
  return JSON.stringify(spec, null, 2);
}

function parsed(text: string): FormResult {
  try {
    return { spec: JSON.parse(text) as Spec, problems: {} };
  } catch (error) {
    return { spec: null, problems: { text: error instanceof Error ? error.message : String(error) } };
  }
}
