package lcm.lcm;

import java.io.DataInput;
import java.io.DataOutput;
import java.io.IOException;

/**
 * LCM's interface of what can be published, declared here, too, so that lcm.publish(channel,
 * message) takes Ruedo's messages where lcm.jar lies beside this library, and they can be used
 * where it does not. Whichever of the two comes first on the class path is taken: they are equal.
 */
public interface LCMEncodable {
    /** Writes the fingerprint and the fields, as LCM has them on the wire. */
    void encode(DataOutput outs) throws IOException;

    /** Writes the fields alone. */
    void _encodeRecursive(DataOutput outs) throws IOException;

    /** Reads the fields alone. */
    void _decodeRecursive(DataInput ins) throws IOException;
}
