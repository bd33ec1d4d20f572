#!/usr/bin/env python3
"""The words of the field, in code, messages and docs: what a reader of robotics or statistics searches for.

Usage: words.py ROOT [--count].  Fails at a word of the left column outside the places of ALLOWED.
"""
import os
import re
import sys

# In identifiers (any part of one) and in sentences; what to write in their place.
WORDS = [
    (r'told|telling|tells?', 'report, show, log, notify; commanded; distinguish (from)'),
    (r'said|saying', 'reported, printed, stated'),
    (r'foretell\w*|foretold', 'predict, predicted'),
    (r'strays?|strayed|straying|astray', 'outlier, contaminated'),
    (r'rivals?', 'baseline, alternative, competing hypothesis'),
    (r'doubts?|doubted|doubtful', 'warning, data-quality warning'),
    (r'surely', 'significantly'),
    (r'afresh', 'restart'),
    (r'inquir(?:y|ies)', 'study, request'),
]
# In identifiers alone: the same in a sentence is plain English.
NAMES = [
    (r'words', 'text, message, label, names, arguments'),
    (r'say|says', 'print, report'),
    (r'so_far', 'partial, progress'),
    (r'left_out|leave_out', 'excluded, held out'),
    (r'kept_apart', 'held out'),
    (r'left_behind|leave_behind', 'outputs, write_outputs'),
    (r'give_up', 'fail with a partial report'),
    (r'second_look|look_without_dropped', 'reselection'),
    (r'question_stamp', 'provenance'),
]
# In sentences alone.
PHRASES = [
    (r'kept apart|left[ -]out|leaves? out|leaving out', 'held out, excluded, omitted'),
    (r'left behind|leaves? behind', 'wrote, outputs'),
    (r'second look', 'reselection'),
    (r'gap closed', 'share of the gap explained'),
]
# Where a word may stand, as (path, word, reason).
ALLOWED = [
    (r'master/evolve/.*|master/experiments/.*|tests/unit/(evolve|compare|blind)/.*|tests/bench/search_.*|docs/optimisers.md', r'tell|told',
     'ask and tell are the standard names of an optimiser\'s two calls'),
    (r'.*', r'tell_?\(|ask/tell|ask, evaluate, tell', 'the same'),
    (r'tests/lint/.*', r'.*', 'this list'),
    (r'CHANGELOG\.md|tests/fuzz/corpus/.*', r'.*', 'history, and data'),
    (r'common/(config|problem|residual)/.*|master/diagnose/result/.*|docs/(formats|diagnosis)\.md|master/report/page/.*'
     r'|tests/.*|proto/.*', r'strays', 'model.toml and diagnosis.json have the key [residual.strays]'),
    (r'master/(cli|command|ground|io)/.*|common/process/.*|docs/(formats|commands)\.md|scripts/.*|tests/.*', r'leave_out|leave-out|doubt|says|said',
     'keys and values of files that users have; --leave-out is an alias'),
    (r'master/cli/completion.*|tests/.*completion.*|scripts/.*', r'words', 'words are what a shell completes'),
    (r'master/report/page/(live|watch)\.js', r'told|said', 'data of the page'),
    (r'common/trials/.*|master/io/.*', r'words', 'words of a text'),
    (r'master/store/sql/.*', r'said', 'comments of tables on disk'),
    (r'tests/unit/store/command_record_test\.cc', r'telling', 'a telling word'),
]

SKIP = re.compile(r'tests/fuzz/corpus/|\.ipynb$|tests/unit/input/data|docs/pictures/')


def groups(rows):
    return re.compile('|'.join(f'(?:{p})' for p, _ in rows), re.I)


WORD = groups(WORDS)
NAME = groups(WORDS + NAMES)
SENTENCE = groups(WORDS + PHRASES)
IDENT = re.compile(r'[A-Za-z_]\w*')
TOKEN = re.compile(r'''(//[^\n]*|/\*.*?\*/)|(R"(\w*)\(.*?\)\3"|"(?:[^"\\\n]|\\.)*"|`(?:[^`\\]|\\.)*`)|'(?:[^'\\\n]|\\.)+\'''', re.S)


def subwords(name):
    return '_'.join(p.lower() for p in re.findall(r'[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+', name))


def in_code(text, found, line):
    for m in IDENT.finditer(text):
        name = '_' + subwords(m.group(0)) + '_'
        for w in re.finditer(r'(?<=_)(?:' + NAME.pattern + r')(?=_)', name):
            found.append((line + text.count('\n', 0, m.start()), w.group(0), m.group(0)))


def in_prose(text, found, line):
    for m in re.finditer(r'(?<![\w"\'.#/-])(?:' + SENTENCE.pattern + r')(?![\w"(]|[-.]\w)', text, re.I):
        found.append((line + text.count('\n', 0, m.start()), m.group(0),
                      ' '.join(text[max(0, m.start() - 30):m.end() + 30].split())))


def words_of(path, text):
    found = []
    if path.endswith(('.h', '.cc', '.inc', '.proto', '.js')):
        at = 0
        for m in TOKEN.finditer(text):
            in_code(text[at:m.start()], found, text.count('\n', 0, at) + 1)
            line = text.count('\n', 0, m.start()) + 1
            if m.group(1):
                in_prose(m.group(1), found, line)
            elif m.group(2) and ' ' in m.group(2):
                in_prose(m.group(2).strip('"`'), found, line)
            at = m.end()
        in_code(text[at:], found, text.count('\n', 0, at) + 1)
    else:
        in_prose(text, found, 1)
    return found


def sources(root):
    for top in ('common', 'master', 'worker', 'proto', 'python', 'scripts', 'tests', 'docs', 'configs', 'README.md',
                'CONTRIBUTING.md'):
        full = os.path.join(root, top)
        if os.path.isfile(full):
            yield top
        for d, folders, files in os.walk(full):
            folders[:] = sorted(f for f in folders if f != '__pycache__')
            for f in sorted(files):
                path = os.path.relpath(os.path.join(d, f), root)
                if f.endswith(('.h', '.cc', '.inc', '.proto', '.js', '.md', '.py', '.sh', '.toml', '.txt')) \
                        and not SKIP.search(path):
                    yield path


def allowed(path, word, where):
    return any(re.fullmatch(p, path) and (re.fullmatch(w, word, re.I) or re.search(w, where)) for p, w, _ in ALLOWED)


def main():
    root = sys.argv[1]
    bad, total, tops = [], 0, {}
    for path in sources(root):
        with open(os.path.join(root, path), encoding='utf-8', errors='replace') as f:
            text = f.read()
        for line, word, where in words_of(path, text):
            total += 1
            top = path.split('/')[0]
            tops[top] = tops.get(top, 0) + 1
            if not allowed(path, word, where):
                bad.append(f'{path}:{line}: "{word}" in "{where}"')
    if '--count' in sys.argv:
        print(total, 'words of the list,', len(bad), 'where none is allowed;',
              ', '.join(f'{t} {n}' for t, n in sorted(tops.items())))
        if '--all' in sys.argv:
            print('\n'.join(bad))
        return 0
    if bad:
        print('\n'.join(bad))
        print('words: what to write in their place stands in tests/lint/words.py')
        for p, instead in WORDS + NAMES + PHRASES:
            if any(re.search(p, b.split('"')[1], re.I) for b in bad):
                print(f'    {p}: {instead}')
        return 1
    print('words: fine')
    return 0


if __name__ == '__main__':
    sys.exit(main())
