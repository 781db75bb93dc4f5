package ruedo;

/** Values between those of two samples. */
final class Between {
    private Between() {}

    static double share(Sample first, Sample second, long utime) {
        return (utime - first.utime) / (double) (second.utime - first.utime);
    }

    static double mixed(double first, double second, double share) {
        return (1.0 - share) * first + share * second;
    }

    static double[] mixed(double[] first, double[] second, double share) {
        double[] made = first.clone();
        for (int i = 0; i < Math.min(first.length, second.length); ++i)
            made[i] = mixed(first[i], second[i], share);
        return made;
    }

    static float[] mixed(float[] first, float[] second, double share) {
        float[] made = first.clone();
        for (int i = 0; i < Math.min(first.length, second.length); ++i)
            made[i] = (float) mixed(first[i], second[i], share);
        return made;
    }

    /**
     * The linear way between unit quaternions, normalised: for the small angles between two samples
     * it is the shortest.
     */
    static double[] turned(double[] first, double[] second, double share) {
        double dot = 0.0;
        for (int i = 0; i < 4; ++i) dot += first[i] * second[i];
        double[] near = second.clone();
        for (int i = 0; i < 4; ++i) near[i] = dot < 0.0 ? -near[i] : near[i];
        double[] made = mixed(first, near, share);
        double norm = 0.0;
        for (double one : made) norm += one * one;
        for (int i = 0; i < 4; ++i) made[i] /= Math.sqrt(norm);
        return made;
    }
}
