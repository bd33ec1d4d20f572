#!/usr/bin/python3
"""Writes what Kubernetes would make of configs/sites/kubernetes/base, for `podman kube play`.
Usage: kubernetes_pods.py configs/sites/kubernetes/base FOLDER

FOLDER/NAME.yaml is a volume claim, or a pod as the controller of a Job makes it of its template: podman 4.3 knows
no Jobs.  What else it lacks, and what stands in for it:
- a Service: the pods share the network of this machine, which has its name; their ports are not mapped then;
- fsGroup: the test's image has the folders that volumes are mounted on, owned by the pods' user;
- a secret volume without `optional` makes it crash: false is Kubernetes' default;
- an init container that is removed when it has ended, the default, is removed by its monitor's clean-up, too, and
  where that is first, seldom, the pod does not start ("no container with ID ... found in DB"): they are kept.
Disruption budgets are for who evicts, which is the test."""
import json
import pathlib
import sys

import yaml


KEPT = {'io.podman.annotations.init.container.type': 'always'}


def pods_of(job):
    """(name, pod) of each pod that stands for this Job at once."""
    name, spec = job['metadata']['name'], job['spec']
    indexed = spec.get('completionMode') == 'Indexed'
    for index in range(spec.get('parallelism', 1)):
        of_pod = f'{name}-{index}' if indexed else name
        metadata = dict(spec['template']['metadata'], name=of_pod, annotations=KEPT)
        yield of_pod, {'apiVersion': 'v1', 'kind': 'Pod', 'metadata': metadata, 'spec': spec['template']['spec']}


def main(base, folder):
    values = [value for name in ('run.yaml', 'workers.yaml')
              for value in yaml.safe_load_all((base / name).read_text())]
    for value in values:
        found = []
        if value['kind'] == 'PersistentVolumeClaim':
            found = [(value['metadata']['name'], value)]
        elif value['kind'] == 'Job':
            found = pods_of(value)
            spec = value['spec']['template']['spec']
            for container in spec['containers']:
                container.pop('ports', None)
            for volume in spec['volumes']:
                if 'secret' in volume:
                    volume['secret'].setdefault('optional', False)
        for name, made in found:
            (folder / f'{name}.yaml').write_text(json.dumps(made))


main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
