"""The chart: what Helm makes of it Kubernetes takes; it is confined and consistent."""

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from app import __version__
from app.cli.serve import GRACE
from app.main import create_app
from app.settings import Settings, Telemetry
from tests.deploy.tools import DEPLOY, passes, run

CHART = DEPLOY / "helm" / "encore"
KUBERNETES = "1.33"
Manifest = dict[str, Any]
EVERYTHING = (
    *("--set", "secret.bootstrapKeyKey=key", "--set", "autoscaling.enabled=true"),
    *("--set", "metrics.serviceMonitor.enabled=true"),
    *("--set", "metrics.rules.enabled=true", "--set", "metrics.dashboard.enabled=true"),
    *("--set", "settings.GUARD=fall_back", "--set", "settings.POOL_SIZE=16"),
    *("--set", "environment.OTEL_TRACES_EXPORTER=otlp"),
    *("--set", "image.tag=1.2", "--set", "workers=4"),
)
CUSTOM = {"PrometheusRule", "ServiceMonitor"}


def rendered(*options: str) -> list[Manifest]:
    words = ("template", "night", CHART, "--set", "secret.name=database", *options)
    return [one for one in yaml.safe_load_all(passes("helm", *words)) if one]


def only(manifests: list[Manifest], kind: str) -> Manifest:
    [found] = [one for one in manifests if one["kind"] == kind]
    return found


def pods(manifests: list[Manifest]) -> list[Manifest]:
    return [
        one["spec"]["template"]
        for one in manifests
        if "template" in one.get("spec", {})
    ]


@pytest.fixture(scope="module")
def plain() -> list[Manifest]:
    return rendered()


@pytest.fixture(scope="module")
def everything() -> list[Manifest]:
    return rendered(*EVERYTHING)


def test_a_linter_finds_nothing() -> None:
    passes("helm", "lint", "--strict", CHART, "--set", "secret.name=database")


@pytest.mark.parametrize("options", [(), EVERYTHING])
def test_it_is_what_kubernetes_takes(options: tuple[str, ...], tmp_path: Path) -> None:
    file = tmp_path / "all.yaml"
    known = [one for one in rendered(*options) if one["kind"] not in CUSTOM]
    file.write_text(yaml.safe_dump_all(known))

    said = passes("kubernetes-validate", "--strict", "-k", KUBERNETES, file)

    assert said.count(" passed ") == len(known)


def test_all_of_it_can_be_asked_for(everything: list[Manifest]) -> None:
    assert sorted(one["kind"] for one in everything) == [
        "ConfigMap",
        "Deployment",
        "HorizontalPodAutoscaler",
        "Job",
        "NetworkPolicy",
        "PodDisruptionBudget",
        "PrometheusRule",
        "Service",
        "ServiceAccount",
        "ServiceMonitor",
    ]


def test_pods_are_confined(everything: list[Manifest]) -> None:
    """As the standard `restricted` of Kubernetes asks, and more."""
    for pod in pods(everything):
        spec = pod["spec"]
        assert spec["automountServiceAccountToken"] is False
        assert spec["enableServiceLinks"] is False
        assert spec["securityContext"] == {
            "runAsNonRoot": True,
            "runAsUser": 65534,
            "runAsGroup": 65534,
            "seccompProfile": {"type": "RuntimeDefault"},
        }
        assert all("emptyDir" in volume for volume in spec["volumes"])
        for container in spec["containers"]:
            assert container["securityContext"] == {
                "allowPrivilegeEscalation": False,
                "readOnlyRootFilesystem": True,
                "capabilities": {"drop": ["ALL"]},
            }
            assert container["resources"]["requests"].keys() == {"cpu", "memory"}
            assert "memory" in container["resources"]["limits"]
            assert "/tmp" in {m["mountPath"] for m in container["volumeMounts"]}  # noqa: S108


def test_everything_means_the_same_pods(everything: list[Manifest]) -> None:
    deployment = only(everything, "Deployment")
    labels = deployment["spec"]["template"]["metadata"]["labels"]
    job = only(everything, "Job")["spec"]["template"]["metadata"]["labels"]
    service = only(everything, "Service")
    monitor = only(everything, "ServiceMonitor")["spec"]["selector"]["matchLabels"]
    selectors = [
        deployment["spec"]["selector"]["matchLabels"],
        service["spec"]["selector"],
        only(everything, "PodDisruptionBudget")["spec"]["selector"]["matchLabels"],
        only(everything, "NetworkPolicy")["spec"]["podSelector"]["matchLabels"],
        *(
            spread["labelSelector"]["matchLabels"]
            for spread in deployment["spec"]["template"]["spec"][
                "topologySpreadConstraints"
            ]
        ),
    ]

    for selector in selectors:
        assert selector.items() <= labels.items()
        assert not selector.items() <= job.items()
    assert monitor.items() <= service["metadata"]["labels"].items()
    target = only(everything, "HorizontalPodAutoscaler")["spec"]["scaleTargetRef"]
    assert target["name"] == deployment["metadata"]["name"]
    assert "replicas" not in deployment["spec"]
    [port] = service["spec"]["ports"]
    [container] = deployment["spec"]["template"]["spec"]["containers"]
    assert port["targetPort"] in {port["name"] for port in container["ports"]}


def test_probes_ask_what_there_is(plain: list[Manifest]) -> None:
    paths = create_app(Settings(database_url="sqlite:///none.db")).openapi()["paths"]
    [container] = only(plain, "Deployment")["spec"]["template"]["spec"]["containers"]

    for probe, path in (
        ("startupProbe", "/health/live"),
        ("livenessProbe", "/health/live"),
        ("readinessProbe", "/health/ready"),
    ):
        asked = container[probe]["httpGet"]
        assert asked["path"] == path
        assert asked["path"] in paths
        assert asked["port"] == container["ports"][0]["name"]


def test_pods_have_time_to_finish(plain: list[Manifest]) -> None:
    spec = only(plain, "Deployment")["spec"]
    pod = spec["template"]["spec"]
    [container] = pod["containers"]
    drain = int(container["lifecycle"]["preStop"]["exec"]["command"][1])

    assert pod["terminationGracePeriodSeconds"] > drain + GRACE
    assert spec["strategy"]["rollingUpdate"]["maxUnavailable"] == 0


def test_settings_are_those_that_there_are(everything: list[Manifest]) -> None:
    known = {f"ENCORE_{name.upper()}" for name in Settings.model_fields}
    known |= {f"OTEL_{name.upper()}" for name in Telemetry.model_fields}
    for pod in pods(everything):
        [container] = pod["spec"]["containers"]
        given = {entry["name"]: entry for entry in container["env"]}
        assert given.keys() <= known
        assert given["ENCORE_POOL_SIZE"]["value"] == "16"
        for secret in ("ENCORE_DATABASE_URL", "ENCORE_BOOTSTRAP_KEY"):
            assert given[secret]["valueFrom"]["secretKeyRef"]["name"] == "database"


def test_tables_are_brought_up_to_date_first(plain: list[Manifest]) -> None:
    job = only(plain, "Job")
    hooks = job["metadata"]["annotations"]["helm.sh/hook"].split(",")
    [migrating] = job["spec"]["template"]["spec"]["containers"]
    [serving] = only(plain, "Deployment")["spec"]["template"]["spec"]["containers"]

    assert hooks == ["pre-install", "pre-upgrade"]
    assert migrating["args"] == ["encore", "migrate"]
    assert serving["args"] == ["encore", "serve", "--workers", "1"]
    assert migrating["image"] == serving["image"] == f"encore:{__version__}"
    assert migrating["env"] == serving["env"]
    assert "serviceAccountName" not in job["spec"]["template"]["spec"]


def test_alerts_and_dashboard_are_those_of_deploy(everything: list[Manifest]) -> None:
    alerts = yaml.safe_load((DEPLOY / "prometheus" / "alerts.yml").read_text())
    shown = only(everything, "ConfigMap")["data"]["encore.json"]
    [endpoint] = only(everything, "ServiceMonitor")["spec"]["endpoints"]

    assert only(everything, "PrometheusRule")["spec"] == alerts
    assert shown.strip() == (DEPLOY / "grafana" / "encore.json").read_text().strip()
    assert {"targetLabel": "job", "replacement": "encore"} in endpoint["relabelings"]


@pytest.mark.parametrize(
    ("option", "complaint"),
    [
        ("secret.name=", "name a Secret"),
        ("settings.PORT=1", "PORT"),
        ("settings.lower=1", "lower"),
        ("workers=0", "workers"),
        ("replica=3", "replica"),
        ("image.digest=latest", "digest"),
        ("terminationGracePeriodSeconds=10", "terminationGracePeriodSeconds"),
    ],
)
def test_values_that_cannot_be_meant_are_refused(option: str, complaint: str) -> None:
    ended = run(
        "helm",
        *("template", "night", CHART, "--set", "secret.name=database"),
        *("--set", option),
    )

    assert ended.returncode != 0
    assert complaint in ended.stderr


def test_the_chart_is_of_this_release() -> None:
    chart = yaml.safe_load((CHART / "Chart.yaml").read_text())
    values = (CHART / "values.yaml").read_text()

    assert chart["appVersion"] == __version__
    assert not re.search(r"password|encore_[0-9a-f]", values)
