#!/usr/bin/env bash
# A test authority and the identities of the three roles of a secured cell. Usage:
#   make_identities.sh DIRECTORY [--from YYYYMMDDHHMMSSZ] [--until YYYYMMDDHHMMSSZ] [--role NAME...]
# Makes DIRECTORY/ca (the authority; keep its key to yourself) and for each role DIRECTORY/ROLE, which is what
# takt-server --secure, takt --secure and TAKT_SECURE take. An authority that is there already is used again, so that
# roles can be added. Roles: server (writes all there is), controller (writes commands and requests, reads all),
# observer (reads all), stranger (an identity without any permission).
set -euo pipefail
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
die() { printf 'make_identities: %s\n' "$*" >&2; exit 2; }

[[ ${1:-} && $1 != -* ]] || { sed -n '2,8s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
directory=$1
shift
from=20200101000000Z until=20400101000000Z roles=()
while (($#)); do
  case $1 in
    --from | --until | --role) [[ ${2:-} ]] || die "$1 needs a value" ;;
    *) die "unknown option '$1'" ;;
  esac
  case $1 in
    --from) from=$2 ;;
    --until) until=$2 ;;
    --role) roles+=("$2") ;;
  esac
  shift 2
done
for time in "$from" "$until"; do
  [[ $time =~ ^[0-9]{14}Z$ ]] || die "'$time' is no time; allowed: YYYYMMDDHHMMSSZ, e.g. 20301231235959Z"
done
((${#roles[@]})) || roles=(server controller observer)
for role in "${roles[@]}"; do
  [[ -f $here/permissions_$role.xml ]] || die "no role '$role'; there are: $(cd "$here" && echo permissions_*.xml |
    sed 's/permissions_//g; s/\.xml//g')"
done
command -v openssl >/dev/null || die 'openssl is needed (Debian package openssl)'

umask 077
mkdir -p "$directory/ca"
ca=$directory/ca
log=$ca/openssl.log
run() { openssl "$@" >>"$log" 2>&1 || { tail -n 5 "$log" >&2; die "openssl $1 failed (log: $log)"; }; }
key() { run ecparam -name prime256v1 -genkey -noout -out "$1"; }
cat >"$ca/openssl.cnf" <<CNF
[ca]
default_ca = authority
[authority]
dir = $ca
database = $ca/index
serial = $ca/serial
new_certs_dir = $ca
certificate = $ca/ca.pem
private_key = $ca/ca_key.pem
default_md = sha256
policy = names
unique_subject = no
[names]
commonName = supplied
organizationName = supplied
[req]
distinguished_name = subject
prompt = no
[subject]
O = takt
CN = takt authority
[authority_extensions]
basicConstraints = critical, CA:TRUE
keyUsage = critical, keyCertSign, cRLSign, digitalSignature
CNF
if [[ ! -f $ca/ca.pem ]]; then
  key "$ca/ca_key.pem"
  run req -x509 -new -config "$ca/openssl.cnf" -extensions authority_extensions -sha256 -days 7300 \
    -key "$ca/ca_key.pem" -out "$ca/ca.pem"
  : >"$ca/index"
  openssl rand -hex 8 | tr a-f A-F >"$ca/serial"
fi
sign() { run smime -sign -in "$1" -text -out "$2" -signer "$ca/ca.pem" -inkey "$ca/ca_key.pem"; }

sign "$here/governance.xml" "$ca/governance.p7s"
for role in "${roles[@]}"; do
  # In a folder of its own until all of it is there: an identity that is in use stays whole.
  to=$directory/.new_$role
  rm -rf "$to" && mkdir -p "$to"
  key "$to/identity_key.pem"
  run req -new -config "$ca/openssl.cnf" -subj "/O=takt/CN=takt $role" -key "$to/identity_key.pem" -out "$ca/$role.csr"
  run ca -batch -notext -config "$ca/openssl.cnf" -startdate "$from" -enddate "$until" -in "$ca/$role.csr" \
    -out "$to/identity.pem"
  sign "$here/permissions_$role.xml" "$to/permissions.p7s"
  cp "$ca/ca.pem" "$to/identity_ca.pem"
  cp "$ca/ca.pem" "$to/permissions_ca.pem"
  cp "$ca/governance.p7s" "$to/"
  mkdir -p "$directory/$role"
  mv "$to"/* "$directory/$role/"
  rmdir "$to"
done
printf 'made %s: %s\n' "$directory" "${roles[*]}"
