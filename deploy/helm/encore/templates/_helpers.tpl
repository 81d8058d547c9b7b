{{- define "encore.name" -}}
{{- default .Chart.Name .Values.nameOverride | trunc 53 | trimSuffix "-" }}
{{- end }}

{{- define "encore.fullname" -}}
{{- if .Values.fullnameOverride }}
{{- .Values.fullnameOverride | trunc 53 | trimSuffix "-" }}
{{- else if contains (include "encore.name" .) .Release.Name }}
{{- .Release.Name | trunc 53 | trimSuffix "-" }}
{{- else }}
{{- printf "%s-%s" .Release.Name (include "encore.name" .) | trunc 53 | trimSuffix "-" }}
{{- end }}
{{- end }}

{{- define "encore.selector" -}}
app.kubernetes.io/name: {{ include "encore.name" . }}
app.kubernetes.io/instance: {{ .Release.Name }}
app.kubernetes.io/component: server
{{- end }}

{{- define "encore.labels" -}}
app.kubernetes.io/name: {{ include "encore.name" . }}
app.kubernetes.io/instance: {{ .Release.Name }}
app.kubernetes.io/version: {{ .Chart.AppVersion | quote }}
app.kubernetes.io/managed-by: {{ .Release.Service }}
helm.sh/chart: {{ printf "%s-%s" .Chart.Name .Chart.Version | replace "+" "_" }}
{{- end }}

{{- define "encore.image" -}}
{{- if .Values.image.digest -}}
{{ .Values.image.repository }}@{{ .Values.image.digest }}
{{- else -}}
{{ .Values.image.repository }}:{{ .Values.image.tag | default .Chart.AppVersion }}
{{- end }}
{{- end }}

{{- define "encore.serviceAccount" -}}
{{- if .Values.serviceAccount.create }}
{{- .Values.serviceAccount.name | default (include "encore.fullname" .) }}
{{- else }}
{{- .Values.serviceAccount.name | default "default" }}
{{- end }}
{{- end }}

{{- define "encore.secret" -}}
{{- required "secret.name: name a Secret that holds the URL of a PostgreSQL database" .Values.secret.name }}
{{- end }}

{{/* What a pod of the standard "restricted" must say of itself. */}}
{{- define "encore.podSecurity" -}}
runAsNonRoot: true
runAsUser: 65534
runAsGroup: 65534
seccompProfile:
  type: RuntimeDefault
{{- end }}

{{- define "encore.containerSecurity" -}}
allowPrivilegeEscalation: false
readOnlyRootFilesystem: true
capabilities:
  drop: [ALL]
{{- end }}

{{/* Settings: of the environment, and of the secret. */}}
{{- define "encore.environment" -}}
- name: ENCORE_DATABASE_URL
  valueFrom:
    secretKeyRef:
      name: {{ include "encore.secret" . }}
      key: {{ .Values.secret.databaseUrlKey }}
{{- with .Values.secret.bootstrapKeyKey }}
- name: ENCORE_BOOTSTRAP_KEY
  valueFrom:
    secretKeyRef:
      name: {{ include "encore.secret" $ }}
      key: {{ . }}
{{- end }}
{{- range $name, $value := .Values.settings }}
- name: ENCORE_{{ $name | upper }}
  value: {{ $value | toString | quote }}
{{- end }}
{{- range $name, $value := .Values.environment }}
- name: {{ $name }}
  value: {{ $value | toString | quote }}
{{- end }}
{{- end }}
