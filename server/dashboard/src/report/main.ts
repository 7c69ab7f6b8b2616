/** The saved report: one file with its data, which opens without a service and without a network. */

import { mount } from 'svelte';
import '../app.css';
import { theme } from '../lib/theme.svelte';
import Report from './Report.svelte';

theme.start();
const data = document.getElementById('data')?.textContent ?? '{}';
mount(Report, { target: document.getElementById('app')!, props: { saved: JSON.parse(data) } });
