package ruedo;

import java.io.ByteArrayInputStream;
import java.io.DataInput;
import java.io.DataInputStream;
import java.io.IOException;
import java.lang.reflect.Constructor;
import java.lang.reflect.InvocationTargetException;

/**
 * A message of a type that the client has no samples of its own for, as a plugin's sensors publish.
 *
 * @param <M> the class that lcm-gen made of its .lcm file; byte[] where none was given
 */
public final class MessageSample<M> extends Sample {
    /** The message, decoded by lcm-gen's class; the bytes themselves without one. */
    public final M message;

    /** LCM's encoding, the type's fingerprint first. */
    public final byte[] bytes;

    private MessageSample(long utime, M message, byte[] bytes) {
        super(utime);
        this.message = message;
        this.bytes = bytes;
    }

    /** Of any type. */
    static Conversions.Conversion raw() {
        return new Conversions.Conversion(
                0, in -> new MessageSample<>(0, in.whole(), in.whole()), true, "raw");
    }

    /** Of a class that lcm-gen made. By reflection, so that it may be of any LCM jar. */
    static <M> Conversions.Conversion of(Class<M> type) {
        try {
            long fingerprint = type.getField("LCM_FINGERPRINT").getLong(null);
            Constructor<M> constructor = type.getConstructor(DataInput.class);
            return new Conversions.Conversion(
                    fingerprint, in -> decode(constructor, in.whole()), false, type.getName());
        } catch (ReflectiveOperationException error) {
            throw new IllegalArgumentException(
                    type.getName() + " is not a class that lcm-gen made of an .lcm file");
        }
    }

    private static <M> Sample decode(Constructor<M> constructor, byte[] bytes) throws IOException {
        try {
            ByteArrayInputStream in = new ByteArrayInputStream(bytes);
            M message = constructor.newInstance(new DataInputStream(in));
            if (in.available() > 0) throw new IOException(in.available() + " bytes too many");
            return new MessageSample<>(utimeOf(message), message, bytes);
        } catch (InvocationTargetException error) { // lcm-gen's decoders believe every length
            throw new IOException(String.valueOf(error.getCause()));
        } catch (ReflectiveOperationException error) {
            throw new IOException(error.toString());
        }
    }

    private static long utimeOf(Object message) {
        try {
            return message.getClass().getField("utime").getLong(message);
        } catch (ReflectiveOperationException | IllegalArgumentException error) {
            return 0; // it has none
        }
    }
}
