# shellcheck shell=sh disable=SC2034
HOW=0.2
