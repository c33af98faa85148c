#!/bin/sh
# An authority in FOLDER, an identity for each NAME, and the two documents that lie beside this
# script, signed: all that `dds: {security: ...}` asks for.
#
# usage: keys.sh FOLDER NAME...
# SPDX-License-Identifier: Apache-2.0
set -eu
here=$(dirname "$0")
folder=$1
shift
umask 077  # the private keys are for their owner only
mkdir -p "$folder"

openssl ecparam -name prime256v1 -genkey -noout -out "$folder/ca.key"
openssl req -x509 -new -key "$folder/ca.key" -subj "/CN=authority" -days 365 -out "$folder/ca.pem"

for name in "$@"; do
  openssl ecparam -name prime256v1 -genkey -noout -out "$folder/$name.key"
  openssl req -new -key "$folder/$name.key" -subj "/CN=$name" -out "$folder/$name.csr"
  openssl x509 -req -in "$folder/$name.csr" -CA "$folder/ca.pem" -CAkey "$folder/ca.key" \
    -CAcreateserial -days 365 -out "$folder/$name.pem"
done

for document in governance permissions; do
  openssl smime -sign -text -in "$here/$document.xml" -signer "$folder/ca.pem" \
    -inkey "$folder/ca.key" -out "$folder/$document.p7s"
done
