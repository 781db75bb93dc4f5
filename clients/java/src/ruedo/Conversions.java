package ruedo;

import java.io.IOException;

/** How each message type becomes a sample. */
final class Conversions {
    /** A message type: its fingerprint, and how its bytes become a sample. */
    static final class Conversion {
        final long fingerprint;
        final Decoder decoder;
        final boolean any; // of messages of any type
        final String key; // distinguishes it from others of a channel; "": Ruedo's own samples

        Conversion(long fingerprint, Decoder decoder) {
            this(fingerprint, decoder, false, "");
        }

        Conversion(long fingerprint, Decoder decoder, boolean any, String key) {
            this.fingerprint = fingerprint;
            this.decoder = decoder;
            this.any = any;
            this.key = key;
        }

        boolean reads(long found) {
            return any || found == fingerprint;
        }
    }

    interface Decoder {
        Sample decode(WireReader in) throws IOException;
    }

    /** Reads the body of a reply. */
    interface Reader<T> {
        T read(WireReader in) throws IOException;
    }

    private Conversions() {}

    /** Null for a type that this library does not know. */
    static Conversion of(String type) {
        return Decoders.ALL.get(type);
    }

    /** The conversion of messages with that fingerprint; null for an unknown type. */
    static Conversion of(long fingerprint) {
        for (Conversion conversion : Decoders.ALL.values()) {
            if (conversion.fingerprint == fingerprint) return conversion;
        }
        return null;
    }
}
