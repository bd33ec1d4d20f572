#!/usr/bin/python3
"""Checks the Kubernetes manifests against the API's types, offline.  Usage: kubernetes_schema.py configs/sites

Every object of the base, of what kustomize makes of the overlay (where kubectl is there) and of kube.toml must
deserialise into its type of the Kubernetes client (which checks what is required), may have no key that the type
does not know, and runs nothing as root, with capabilities or a root file system that can be written, or without
requests and limits.  Every Job is probed and has a disruption budget."""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tomllib

SKIPPED = 77
try:
    import yaml
    from kubernetes import client
except ImportError as error:
    print(f'not run: {error} (scripts/setup.sh --tests)')
    sys.exit(SKIPPED)

TYPES = {('v1', 'Service'): 'V1Service',
         ('v1', 'Pod'): 'V1Pod',
         ('policy/v1', 'PodDisruptionBudget'): 'V1PodDisruptionBudget',
         ('v1', 'PersistentVolumeClaim'): 'V1PersistentVolumeClaim',
         ('batch/v1', 'Job'): 'V1Job'}
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


def policy_failures(value, where):
    """Takes a Job's pod failure policy out, which the API has from 1.26 on and an older client does not know, and
    says what of it is not as https://kubernetes.io/docs/reference/kubernetes-api/workload-resources/job-v1 has it."""
    policy = value['spec'].pop('podFailurePolicy', None) if value['kind'] == 'Job' else {'rules': []}
    if policy is None:
        return [f'{where}: has no pod failure policy']
    found = [f'{where}: {key} is no part of a pod failure policy' for key in policy if key != 'rules']
    for rule in policy['rules']:
        codes, conditions = rule.get('onExitCodes', {}), rule.get('onPodConditions', [])
        sound = (rule['action'] in ('FailJob', 'Ignore', 'Count') and bool(codes) != bool(conditions)
                 and set(rule) <= {'action', 'onExitCodes', 'onPodConditions'}
                 and set(codes) <= {'containerName', 'operator', 'values'}
                 and all(set(c) == {'type', 'status'} for c in conditions))
        if not sound:
            found.append(f'{where}: a rule of its pod failure policy is none: {rule}')
    return found


def unsafe(value, where):
    """What a pod of this object may do that it need not."""
    spec = value['spec'].get('template', value)['spec'] if value['kind'] in ('Job', 'Pod') else None
    if spec is None:
        return []
    found = [] if spec['securityContext'].get('runAsNonRoot') else [f'{where}: may run as root']
    for container in spec.get('initContainers', []) + spec['containers']:
        own = container.get('securityContext', {})
        if not own.get('readOnlyRootFilesystem') or own.get('allowPrivilegeEscalation', True):
            found.append(f'{where}: {container["name"]} may write its root or gain privileges')
        if own.get('capabilities') != {'drop': ['ALL']}:
            found.append(f'{where}: {container["name"]} has capabilities')
        if container not in spec['containers']:
            continue
        if set(container.get('resources', {})) != {'requests', 'limits'}:
            found.append(f'{where}: {container["name"]} has no requests or no limits')
        if value['kind'] == 'Job' and 'livenessProbe' not in container:
            found.append(f'{where}: {container["name"]} is not probed')
    return found


def without_budget(values, name):
    """Jobs whose pods no disruption budget selects."""
    budgets = [v['spec']['selector']['matchLabels'] for v in values if v['kind'] == 'PodDisruptionBudget']
    return [f'{name}: Job {job["metadata"]["name"]} has no disruption budget' for job in values
            if job['kind'] == 'Job' and job['spec']['template']['metadata']['labels'] not in budgets]


def sources(folder):
    """(name, text) of everything that is for Kubernetes."""
    for path in sorted((folder / 'kubernetes/base').glob('*.yaml')):
        if path.name != 'kustomization.yaml':
            yield path.name, path.read_text()
    if shutil.which('kubectl'):
        yield 'overlay', subprocess.run(['kubectl', 'kustomize', folder / 'kubernetes/overlay'], check=True,
                                        capture_output=True, text=True).stdout
    else:
        print('not checked: the overlay (kubectl is not installed)')
    site = tomllib.loads((folder / 'kube.toml').read_text())
    for wall, avoid in (('', ''), (site['wall'][0], site['avoid'][0])):
        text = site['script'].replace('{wall}', wall).replace('{avoid}', avoid)
        for word, means in {'name': 'gf01234567', 'cores': '2', 'seconds': '3600', 'nodes': 'n1,n2',
                            'worker': 'gapfarm-worker --connect tcp://gapfarm:5555 --keys /keys/own'}.items():
            text = text.replace('{' + word + '}', means)
        yield 'kube.toml', text


def main(folder):
    failures = []
    objects = 0
    for name, text in sources(pathlib.Path(folder)):
        values = list(yaml.safe_load_all(text))
        failures += without_budget(values, name)
        for value in values:
            objects += 1
            where = f'{name}: {value["kind"]} {value["metadata"].get("name", "")}'
            kind = TYPES[value['apiVersion'], value['kind']]
            failures += policy_failures(value, where)
            failures += unknown_keys(value, kind, where) + unsafe(value, where)
            try:
                api.deserialize(Response(value), kind)
            except ValueError as error:
                failures.append(f'{where}: {error}')
    print('\n'.join(failures) or f'{objects} objects: fine')
    return 1 if failures or not objects else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))
