module trial {
    requires ruedo;
}
