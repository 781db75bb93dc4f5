package ruedo.lcmtypes;

import java.io.DataInput;
import java.io.DataOutput;
import java.io.IOException;

/**
 * What all message types here can do. It takes the place of LCM's interface, so that this library
 * holds no class of LCM's and any LCM may lie beside it. To publish one with LCM's own classes,
 * encode it: {@code lcm.publish(channel, bytes, 0, bytes.length)}.
 */
public interface Message {
    /** Writes the fingerprint and the fields, as LCM has them on the wire. */
    void encode(DataOutput out) throws IOException;

    /** Writes the fields alone. */
    void _encodeRecursive(DataOutput out) throws IOException;

    /** Reads the fields alone. */
    void _decodeRecursive(DataInput in) throws IOException;
}
