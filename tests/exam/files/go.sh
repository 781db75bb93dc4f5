#!/bin/sh
# shellcheck source=/dev/null
. ./how.sh
exec "$RUEDO_PYTHON" drive.py "$HOW"
