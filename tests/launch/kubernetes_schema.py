#!/usr/bin/python3
"""Checks the Kubernetes manifests against the API's types, offline.

Every object of scripts/launch/kubernetes must deserialise into its type of the Kubernetes client
(which checks what is required), and may have no key that the type does not know."""
import json
import pathlib
import re
import sys

SKIPPED = 77
try:
    import yaml
    from kubernetes import client
except ImportError as error:
    print(f'not run: {error} (scripts/setup.sh --tests)')
    sys.exit(SKIPPED)

TYPES = {('v1', 'Service'): 'V1Service',
         ('v1', 'PersistentVolumeClaim'): 'V1PersistentVolumeClaim',
         ('batch/v1', 'Job'): 'V1Job',
         ('apps/v1', 'Deployment'): 'V1Deployment'}
api = client.ApiClient()


class Response:
    def __init__(self, value):
        self.data = json.dumps(value)


def unknown_keys(value, kind, where):
    """Paths of keys of `value` that the type named `kind` does not have."""
    listed = re.fullmatch(r'list\[(.*)\]', kind)
    if listed:
        if not isinstance(value, list):
            return [f'{where}: a list is wanted']
        return [path for i, item in enumerate(value)
                for path in unknown_keys(item, listed[1], f'{where}[{i}]')]
    known = getattr(client, kind, None)
    if known is None or not isinstance(value, dict):
        return []
    attributes = {key: name for name, key in known.attribute_map.items()}
    found = []
    for key, item in value.items():
        if key in attributes:
            found += unknown_keys(item, known.openapi_types[attributes[key]], f'{where}.{key}')
        else:
            found.append(f'{where}.{key}: no such key')
    return found


def main(folder):
    failures = []
    objects = 0
    for path in sorted(pathlib.Path(folder).glob('*.yaml')):
        for value in yaml.safe_load_all(path.read_text()):
            objects += 1
            where = f'{path.name}: {value["kind"]} {value["metadata"]["name"]}'
            kind = TYPES[value['apiVersion'], value['kind']]
            failures += unknown_keys(value, kind, where)
            try:
                api.deserialize(Response(value), kind)
            except ValueError as error:
                failures.append(f'{where}: {error}')
    print('\n'.join(failures) or f'{objects} objects: fine')
    return 1 if failures or not objects else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))
