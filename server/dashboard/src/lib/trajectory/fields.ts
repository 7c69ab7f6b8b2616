/** Fields of a form for a trajectory, made from the JSON Schema of the specification: bounds and defaults have one source. */

/** As much of a JSON Schema as the specification uses. */
export interface Schema {
  readonly type?: string;
  readonly description?: string;
  readonly default?: unknown;
  readonly const?: unknown;
  readonly minimum?: number;
  readonly maximum?: number;
  readonly exclusiveMinimum?: number;
  readonly anyOf?: readonly Schema[];
  readonly properties?: Readonly<Record<string, Schema>>;
  readonly $defs?: Readonly<Record<string, Schema>>;
  readonly discriminator?: { readonly mapping: Readonly<Record<string, string>> };
}

export interface Bounds {
  readonly low: number | null;
  readonly high: number | null;
  /** Whether `low` itself is not allowed. */
  readonly above: boolean;
}

export interface TrajectoryField {
  readonly name: string;
  readonly label: string;
  /** Of what is shown and typed. */
  readonly unit: string;
  /** Shown value = value of the specification × scale. */
  readonly scale: number;
  /** `amplitude`: one number for all joints, or one a joint. */
  readonly type: 'number' | 'integer' | 'boolean' | 'amplitude';
  /** In the specification's unit. */
  readonly bounds: Bounds;
  readonly standard: unknown;
}

export interface TrajectoryKind {
  readonly kind: string;
  readonly label: string;
  readonly description: string;
  /** Empty for a kind that has no form: its specification is edited as text. */
  readonly fields: readonly TrajectoryField[];
}

export const DEGREES = 180 / Math.PI;

/** What a schema does not say: how people call a field, and the unit in which they think of it. */
const WORDS: Readonly<Record<string, readonly [label: string, unit: string, scale: number]>> = {
  amplitude: ['Amplitude', '°', DEGREES],
  duration: ['Duration', 's', 1],
  steps: ['Steps', '', 1],
  dwell: ['Time on each step', 's', 1],
  back: ['Down again', '', 1],
  speed: ['Speed', '°/s', DEGREES],
  reversals: ['Reversals', '', 1],
  period: ['Period', 's', 1],
  cycles: ['Cycles', '', 1],
  phase: ['Phase from joint to joint', '°', DEGREES],
  lowest: ['Lowest frequency', 'Hz', 1],
  highest: ['Highest frequency', 'Hz', 1],
  tones: ['Tones', '', 1],
  seed: ['Seed of the phases', '', 1],
  lift: ['Height of lift-off and set-down', 'm', 1],
  pick: ['Time up to lift-off', 's', 1],
  travel: ['Time over', 's', 1],
  place: ['Time down to set-down', 's', 1],
};

/** Kinds with a list of points or of pieces have no form. */
const hasList = (properties: readonly (readonly [string, Schema])[]): boolean =>
  properties.some(([, property]) => property.type === 'array');

/** Every kind of trajectory that the specification knows, in its order. */
export function kindsOf(schema: Schema): TrajectoryKind[] {
  const definitions = schema.$defs ?? {};
  const mapping = schema.properties?.trajectory?.discriminator?.mapping ?? {};
  const order = Object.keys(definitions);
  return Object.entries(mapping)
    .map(([kind, reference]) => ({ kind, name: reference.split('/').at(-1) ?? '' }))
    .sort((one, other) => order.indexOf(one.name) - order.indexOf(other.name))
    .map(({ kind, name }) => kindOf(kind, definitions[name] ?? {}));
}

function kindOf(kind: string, schema: Schema): TrajectoryKind {
  const properties = Object.entries(schema.properties ?? {}).filter(([name]) => name !== 'kind');
  return {
    kind,
    label: sentence(kind.replaceAll('_', ' ')),
    description: plain(schema.description ?? ''),
    fields: hasList(properties) ? [] : properties.map(([name, property]) => fieldOf(name, property)),
  };
}

/** How people call a field, by its last name. */
export function labelOf(name: string): string {
  return WORDS[name]?.[0] ?? sentence(name.replaceAll('_', ' '));
}

function fieldOf(name: string, schema: Schema): TrajectoryField {
  const [, unit, scale] = WORDS[name] ?? ['', '', 1];
  const label = labelOf(name);
  const number = schema.anyOf?.find((branch) => branch.type === 'number');
  return {
    name,
    label,
    unit,
    scale,
    type: number ? 'amplitude' : (schema.type as TrajectoryField['type']),
    bounds: boundsOf(number ?? schema),
    standard: schema.default,
  };
}

export function boundsOf(schema: Schema): Bounds {
  return {
    low: schema.exclusiveMinimum ?? schema.minimum ?? null,
    high: schema.maximum ?? null,
    above: schema.exclusiveMinimum !== undefined,
  };
}

/** The first paragraph, without the marks of code. */
function plain(text: string): string {
  return (text.split('\n\n')[0] ?? '').replaceAll('\n', ' ').replaceAll('`', '');
}

function sentence(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
