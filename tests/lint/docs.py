#!/usr/bin/env python3
"""Docs that hold: links and anchors exist, paths of sources exist, commands are commands, each page begins
with its purpose and a command, README is short, the table of
settings is what its script prints.  Usage: docs.py ROOT"""
import os
import re
import subprocess
import sys

README_LINES = 80    # one screen and a half
FIRST_LINES = 30     # of a page, in which a command stands


def slug(heading):
    text = re.sub(r'[`*]', '', re.sub(r'^#+ ', '', heading)).strip().lower()
    text = re.sub(r'\[([^\]]*)\]\([^)]*\)', r'\1', text)
    return re.sub(r'[^\w\- ]', '', text).replace(' ', '-')


def outside_fences(text):
    return re.sub(r'^```.*?^```', lambda m: '\n' * m.group(0).count('\n'), text, flags=re.M | re.S)


def anchors(path):
    with open(path, encoding='utf-8') as f:
        return {slug(h) for h in re.findall(r'^#+ .*$', outside_fences(f.read()), re.M)}


def pages(root):
    for name in ('README.md', 'CONTRIBUTING.md'):
        yield name
    for d, _, files in os.walk(os.path.join(root, 'docs')):
        for f in sorted(files):
            if f.endswith('.md'):
                yield os.path.relpath(os.path.join(d, f), root)


def commands_of(root):
    """The names in the table of commands, wherever in master/cli it lies."""
    found = set()
    for name in ('commands.inc', 'subcommands.cc'):
        path = os.path.join(root, 'master/cli', name)
        if os.path.exists(path):
            with open(path, encoding='utf-8') as f:
                text = f.read()
            found |= set(re.findall(r'\{"([a-z-]+)",', text)) | set(re.findall(r'"([a-z-]+)",\s*"[^"]*\w ', text))
    return found | {'help'}


def check_page(root, page, commands):
    wrong = []
    with open(os.path.join(root, page), encoding='utf-8') as f:
        text = f.read()
    here = os.path.dirname(os.path.join(root, page))
    for target, anchor in re.findall(r'\]\((?!https?:)([^)#\s]*)(?:#([\w-]+))?\)', outside_fences(text)):
        full = os.path.normpath(os.path.join(here, target)) if target else os.path.join(root, page)
        if not os.path.exists(full):
            wrong.append(f'{page}: links to {target}, which is not there')
        elif anchor and full.endswith('.md') and anchor not in anchors(full):
            wrong.append(f'{page}: links to {target}#{anchor}; that page has no such heading')
    for line in re.findall(r'^    (?:\$ )?(?:build/\w+/bin/)?gapfarm ([a-z][a-z-]*)(?= |$)', text, re.M):
        if line not in commands:
            wrong.append(f'{page}: there is no command "gapfarm {line}"')
    if page.startswith('docs/') and not page.startswith('docs/evidence/'):
        if not re.search(r'^(    \S|```)', '\n'.join(text.split('\n')[:FIRST_LINES]), re.M):
            wrong.append(f'{page}: no command in its first {FIRST_LINES} lines; say what the page is for, then show one')
    for path in set(re.findall(r'`((?:common|master|worker|proto|scripts|tests)/[\w/.@-]+)', text)):
        if not os.path.exists(os.path.join(root, path)):
            wrong.append(f'{page}: names {path}, which is not there')
    return wrong


def main():
    root = sys.argv[1]
    wrong = []
    commands = commands_of(root)
    for page in pages(root):
        wrong += check_page(root, page, commands)
    with open(os.path.join(root, 'README.md'), encoding='utf-8') as f:
        lines = len(f.read().split('\n'))
    if lines > README_LINES:
        wrong.append(f'README.md: {lines} lines, at most {README_LINES}; what is more goes to docs/')
    settings = subprocess.run([os.path.join(root, 'scripts/settings.py')], capture_output=True, text=True, check=False)
    with open(os.path.join(root, 'docs/evidence/settings.md'), encoding='utf-8') as f:
        if settings.returncode != 0 or settings.stdout != f.read():
            wrong.append(settings.stderr + 'docs/evidence/settings.md: make it anew: scripts/settings.py > docs/evidence/settings.md')
    if wrong:
        print('\n'.join(wrong))
        return 1
    print('docs: fine')
    return 0


if __name__ == '__main__':
    sys.exit(main())
