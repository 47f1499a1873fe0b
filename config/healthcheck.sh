#!/bin/sh
# Whether the service of this container works: healthcheck.sh router|STAGE
# To ask it takes a session, and a quarter of a second of processor time to load what opens one. So an answer counts for half a
# minute: six containers that were asked in full every few seconds took half a processor. What hangs meanwhile, the guard ends.
answered="${TMPDIR:-/tmp}/answered"
[ -n "$(find "$answered" -newermt '-30 seconds' 2>/dev/null)" ] && exit 0
python -m deixis_runtime.healthcheck "$1" && touch "$answered"
