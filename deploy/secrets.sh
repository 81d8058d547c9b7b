#!/bin/sh
# Makes the secrets that compose.yaml needs, in the folder that is given (else
# `secrets` beside compose.yaml). Those that are there are kept.
#
# Only you may enter the folder; the files themselves are readable, as each is shown to
# one container, whose user is another.
set -eu
umask 022

folder=${1:-$(dirname "$0")/../secrets}
mkdir -p "$folder"
chmod 700 "$folder"

random() {
    od -An -N24 -tx1 /dev/urandom | tr -d ' \n'
}

keep() {
    [ -e "$folder/$1" ] || printf '%s' "$2" >"$folder/$1"
}

keep postgres_password "$(random)"
keep database_url "postgresql://encore:$(cat "$folder/postgres_password")@postgres/encore"
keep bootstrap_key "encore_$(random)"
keep grafana_password "$(random)"
echo "The admin key is in $folder/bootstrap_key, Grafana's password (of admin) in $folder/grafana_password."
