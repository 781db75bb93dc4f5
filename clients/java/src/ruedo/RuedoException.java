package ruedo;

/**
 * The errors of this library, whose messages say what to do. Bad arguments are
 * IllegalArgumentExceptions.
 */
public class RuedoException extends RuntimeException {
    private static final long serialVersionUID = 1L;

    RuedoException(String text) {
        super(text);
    }

    RuedoException(String text, Throwable cause) {
        super(text, cause);
    }

    /**
     * An exception of a callback, which is the cause; the next call of its simulation throws it.
     */
    public static final class CallbackException extends RuedoException {
        private static final long serialVersionUID = 1L;

        CallbackException(String text, Throwable cause) {
            super(text, cause);
        }
    }

    /** No server answered, or it fell silent or ended. */
    public static class NoServer extends RuedoException {
        private static final long serialVersionUID = 1L;

        NoServer(String text) {
            super(text);
        }
    }

    /** The run is over: its server has said so, or ended with exit code 0. */
    public static final class RunEnded extends NoServer {
        private static final long serialVersionUID = 1L;

        RunEnded(String text) {
            super(text);
        }
    }

    /** A private server could not be started. */
    public static final class LaunchError extends RuedoException {
        private static final long serialVersionUID = 1L;

        LaunchError(String text) {
            super(text);
        }
    }

    /** There is no robot, device or channel of that name; the text lists those that exist. */
    public static final class UnknownName extends RuedoException {
        private static final long serialVersionUID = 1L;

        UnknownName(String text) {
            super(text);
        }
    }

    /** No message or reply came within the timeout. */
    public static final class Timeout extends RuedoException {
        private static final long serialVersionUID = 1L;

        Timeout(String text) {
            super(text);
        }
    }

    /** A channel carries another version of a message type than this library reads. */
    public static final class TypeMismatch extends RuedoException {
        private static final long serialVersionUID = 1L;

        TypeMismatch(String text) {
            super(text);
        }
    }

    /** The server or the robot cannot do that. */
    public static final class NotSupported extends RuedoException {
        private static final long serialVersionUID = 1L;

        NotSupported(String text) {
            super(text);
        }
    }

    /** A motion primitive ended before it was done, or was refused. */
    public static final class MotionError extends RuedoException {
        private static final long serialVersionUID = 1L;

        /** The reason, as in {@link MotionStatus#reason}. */
        public final String reason;

        MotionError(String text, String reason) {
            super(text);
            this.reason = reason;
        }
    }

    /** The server refused a request. */
    public static class RequestError extends RuedoException {
        private static final long serialVersionUID = 1L;

        /** The code of reply_t. */
        public final int code;

        RequestError(String text, int code) {
            super(text);
            this.code = code;
        }
    }

    /**
     * Lockstep continues without this client, which was silent for too long; the next step() takes
     * part again.
     */
    public static final class LeaseLost extends RequestError {
        private static final long serialVersionUID = 1L;

        LeaseLost(String text, int code) {
            super(text, code);
        }
    }

    /** The thread was interrupted while it waited. */
    public static final class Interrupted extends RuedoException {
        private static final long serialVersionUID = 1L;

        Interrupted() {
            super("interrupted while waiting");
        }
    }
}
