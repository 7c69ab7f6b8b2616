/** What can follow in a line of the console: commands, options and usual values, as the command line has them. Pure. */

import type { ConsoleCommand } from '../api/types';

export interface Offer {
  readonly text: string;
  readonly help: string;
}

export interface Completion {
  /** Where the word begins that is replaced. */
  readonly from: number;
  readonly offers: readonly Offer[];
}

const HELP: Offer = { text: 'help', help: 'Show the commands, or the options of one.' };
const none = (from: number): Completion => ({ from, offers: [] });

/** What can stand where a line ends. */
export function completion(line: string, commands: readonly ConsoleCommand[]): Completion {
  const words = line.trimStart().split(/\s+/);
  const begun = words.pop() ?? '';
  const from = line.length - begun.length;
  if (words[0] === 'daq') words.shift();
  const isHelp = words[0] === 'help';
  if (isHelp) words.shift();
  const command = commandOf(words, commands);
  if (command === undefined) {
    const offers = new Map<string, Offer>();
    for (const one of commands) {
      const isBelow = words.every((word, place) => one.words[place] === word);
      const next = one.words[words.length];
      if (!isBelow || next === undefined || offers.has(next)) continue;
      const isLast = one.words.length === words.length + 1;
      offers.set(next, { text: next, help: isLast ? one.help : 'More words follow.' });
    }
    if (words.length === 0 && !isHelp) offers.set('help', HELP);
    return { from, offers: [...offers.values()].filter((one) => one.text.startsWith(begun)) };
  }
  if (isHelp) return none(from);
  const after = words.slice(command.words.length);
  const last = command.options.find((one) => one.flags.includes(after.at(-1) ?? ''));
  if (last?.takes_value) return { from, offers: matching(last.choices, begun, last.help) };
  const open = command.options.filter((one) => !one.flags.some((flag) => after.includes(flag)));
  const values = open.filter((one) => one.flags.length === 0).flatMap((one) => one.choices);
  const flags = open
    .filter((one) => one.flags.length > 0)
    .map((one) => ({ text: one.flags[0]!, help: withDefault(one.help, one.default) }));
  const offers = begun.startsWith('-') ? [] : matching(after.length === 0 ? values : [], begun, '');
  return { from, offers: [...offers, ...flags.filter((one) => one.text.startsWith(begun))] };
}

/** The command that words begin with. */
export function commandOf(
  words: readonly string[],
  commands: readonly ConsoleCommand[],
): ConsoleCommand | undefined {
  return commands.find((one) => one.words.every((word, place) => words[place] === word));
}

/** What `help` and `help run ramp` print. */
export function helpOf(words: readonly string[], commands: readonly ConsoleCommand[]): string[] {
  const command = commandOf(words, commands);
  if (command !== undefined) {
    const rows = command.options.map((one) => [
      one.flags[0] ?? one.name.toUpperCase(),
      withDefault(one.help, one.default),
    ]);
    return [command.help, ...inColumns(rows)];
  }
  const wanted = commands.filter((one) => words.every((word, place) => one.words[place] === word));
  const shown = wanted.length > 0 ? wanted : commands;
  return inColumns(shown.map((one) => [one.words.join(' '), one.help.replaceAll('`daq ', '`')]));
}

/** Options of a line that have a value: `--amplitude 5`. `at`: where the value begins. */
export interface Given {
  readonly name: string;
  readonly value: string;
  readonly at: number;
}

/** The values in a line of `run`, for those who want parameters in their place; those that have one already are left out. */
export function givenIn(line: string): Given[] {
  return [...line.matchAll(/--([a-z][a-z-]*)[ =]([^\s{}'"]+)(?=\s|$)/g)]
    .filter((found) => found[1] !== 'name' && (!found[2]!.startsWith('-') || /^-[\d.]/.test(found[2]!)))
    .map((found) => ({
      name: found[1]!.replaceAll('-', '_'),
      value: found[2]!,
      at: found.index + found[0].length - found[2]!.length,
    }));
}

function matching(values: readonly string[], begun: string, help: string): Offer[] {
  return values.filter((one) => one.startsWith(begun)).map((text) => ({ text, help }));
}

function withDefault(help: string, standard: string): string {
  return standard === '' ? help : `${help} Without it: ${standard}.`;
}

function inColumns(rows: readonly (readonly string[])[]): string[] {
  const width = Math.max(0, ...rows.map(([first = '']) => first.length));
  return rows.map(([first = '', second = '']) => `${first.padEnd(width)}  ${second}`);
}
