"""Images: reading and writing files, and metrics between two images (PSNR, SSIM, LPIPS)."""
