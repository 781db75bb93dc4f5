module trial {
  requires ruedo;
}
