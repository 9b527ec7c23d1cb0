! SPDX-License-Identifier: MIT
!> What a checkpoint says about itself.
module rockdda_io_checkpoint_info
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type
   use rockdda_io_checkpoint, only : checkpoint_type, checkpoint_facts_type
   use rockdda_io_digest, only : digest_of_text, hexadecimal, digest_length
   implicit none
   private
   public :: checkpoint_info_type, read_checkpoint_info

   type :: checkpoint_info_type
      type(checkpoint_facts_type) :: facts
      character(len=2*digest_length) :: digest = ''
      character(len=2*digest_length) :: input_digests(3) = ''   !! geometry, analysis, config
      integer :: step = 0
      real(wp) :: time = 0
      integer :: n_steps = 0                       !! where the run is to end, huge: no limit
      real(wp) :: t_end = huge(1.0_wp)
      integer :: n_blocks = 0, n_contacts = 0
      character(len=:), allocatable :: solver
   end type checkpoint_info_type

contains

   !> Read the summary, after all tests of the file. An error (code input) when it is none or damaged.
   subroutine read_checkpoint_info(path, info, error)
      character(len=*), intent(in) :: path
      type(checkpoint_info_type), intent(out) :: info
      type(error_type), allocatable, intent(out) :: error
      type(checkpoint_type) :: checkpoint
      call checkpoint%begin_loading(path, info%facts, error)
      if (allocated(error)) return
      associate (archive => checkpoint%archive)
         call archive%section('state')
         call archive%item('step', info%step)
         call archive%item('time', info%time)
         call archive%section('parameters')
         call archive%item('n_steps', info%n_steps)
         call archive%item('t_end', info%t_end)
         call archive%item('solver_method', info%solver)
         call archive%section('model')
         call archive%item('n_blocks', info%n_blocks)
         call archive%section('contacts')
         call archive%item('n', info%n_contacts)
      end associate
      call checkpoint%end_loading(error)
      info%digest = hexadecimal(checkpoint%digest)
      info%input_digests(1) = hexadecimal(digest_of_text(info%facts%header%geometry))
      info%input_digests(2) = hexadecimal(digest_of_text(info%facts%header%analysis))
      info%input_digests(3) = hexadecimal(digest_of_text(info%facts%header%config))
   end subroutine read_checkpoint_info

end module rockdda_io_checkpoint_info
