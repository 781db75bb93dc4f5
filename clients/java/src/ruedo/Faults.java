package ruedo;

/** Prints an exception in a thread that must continue. */
final class Faults {
    private Faults() {}

    /**
     * Throws nothing: neither for want of memory, nor what the description of an exception throws
     * in its turn.
     */
    static void tell(String before, Throwable error, String after) {
        try {
            System.err.println("ruedo: " + before + described(error) + after);
        } catch (Throwable again) {
            // there is no memory even for that
        }
    }

    /** Where it was thrown. */
    static void trace(Throwable error) {
        try {
            error.printStackTrace();
        } catch (Throwable again) {
            // its description throws in its turn
        }
    }

    static String described(Throwable error) {
        try {
            return error.toString();
        } catch (Throwable again) {
            return error.getClass().getName();
        }
    }
}
