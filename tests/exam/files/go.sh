. ./how.sh
exec "$RUEDO_PYTHON" drive.py "$HOW"
