import { describe, expect, it } from 'vitest';
import type { ConsoleCommand } from '../api/types';
import { completion, givenIn, helpOf } from './completion';

const option = (name: string, choices: string[] = [], takes_value = true) => ({
  name,
  flags: [`--${name}`],
  takes_value,
  help: `About ${name}.`,
  default: name === 'joints' ? '1-3' : '',
  choices,
});
const COMMANDS: ConsoleCommand[] = [
  {
    words: ['run', 'ramp'],
    help: 'Equal increments.',
    options: [option('amplitude'), option('joints', ['1-3', '1', '2']), option('dry-run', [], false)],
  },
  {
    words: ['run', 'preset'],
    help: 'Run an experiment by name.',
    options: [{ ...option('name', ['ramp', 'held-out']), flags: [] }, option('dry-run', [], false)],
  },
  { words: ['stop'], help: 'Freeze every robot.', options: [] },
];
const offered = (line: string): string[] => completion(line, COMMANDS).offers.map((one) => one.text);

describe('completion', () => {
  it('offers commands, then their options, then usual values', () => {
    expect(offered('')).toEqual(['run', 'stop', 'help']);
    expect(offered('r')).toEqual(['run']);
    expect(offered('daq run ')).toEqual(['ramp', 'preset']);
    expect(offered('run ramp ')).toEqual(['--amplitude', '--joints', '--dry-run']);
    expect(offered('run ramp --joints ')).toEqual(['1-3', '1', '2']);
    expect(offered('run ramp --joints 1 --')).toEqual(['--amplitude', '--dry-run']);
    expect(offered('run preset h')).toEqual(['held-out']);
    expect(offered('run preset held-out ')).toEqual(['--dry-run']);
    expect(offered('help run r')).toEqual(['ramp']);
    expect(offered('nothing ')).toEqual([]);
  });

  it('replaces the word that is begun and no other', () => {
    expect(completion('run ramp --jo', COMMANDS).from).toBe(9);
    expect(completion('run ramp ', COMMANDS).from).toBe(9);
  });
});

describe('help', () => {
  it('lists the commands below the words, or the options of one command', () => {
    expect(helpOf([], COMMANDS)).toHaveLength(3);
    expect(helpOf(['run'], COMMANDS)).toEqual([
      'run ramp    Equal increments.',
      'run preset  Run an experiment by name.',
    ]);
    expect(helpOf(['run', 'ramp'], COMMANDS)[2]).toBe('--joints     About joints. Without it: 1-3.');
  });
});

describe('the values in a line', () => {
  it('are those of options, also below zero, and not those that are parameters already', () => {
    const line = 'run ramp --joints 2 --amplitude -5.5 --hold {hold} --dry-run --name "a b"';
    expect(givenIn(line).map((one) => [one.name, one.value])).toEqual([
      ['joints', '2'],
      ['amplitude', '-5.5'],
    ]);
    expect(line.slice(givenIn(line)[1]!.at)).toMatch(/^-5\.5/);
  });
});
