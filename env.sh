cd /work/w/plan
export PYTHONPATH=/work/w/plan/python:/work/w/plan/tests
export PATH=/work/main/.venv/bin:$PATH
export CARGO_TARGET_DIR=/work/w/target-plan
